"""Section "bus and queues": what happens between the bytes, seen from the bus."""

from __future__ import annotations

import tracemalloc

import pytest

from sim.analyser35670a import TalkState

QYE, OPC = 4, 1


def status_after(controller, wanted: int) -> list[int]:
    """Query errors in the queue, with the bit that goes with them."""
    assert controller.instrument.status.standard_event & QYE
    found = controller.errors()
    assert wanted in found
    return found


@pytest.mark.parametrize(
    ("pieces", "eoi"),
    [
        ([b"*IDN?\n"], False),
        ([b"*IDN?"], True),
        ([b"*IDN?\n"], True),
        ([b"*ID", b"N?", b"\r\n"], False),
        ([bytes([byte]) for byte in b"  *idn?\n"], False),
    ],
)
def test_message_ends_on_line_feed_or_eoi(controller, pieces, eoi):
    """It may come in pieces."""
    for index, piece in enumerate(pieces):
        controller.write(piece, end=eoi and index == len(pieces) - 1)
    assert controller.read() == b"HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11\n"


def test_long_message_is_held_not_dropped(controller):
    controller.write("INST:SEL SINE")
    message = ";".join([":FREQ:STAR 100"] * 30) + ";:FREQ:STOP 321\n"
    assert len(message) > 3 * 128
    controller.write(message.encode())
    assert controller.number("FREQ:STOP?") == 321
    assert controller.errors() == []


def test_input_queue_holds_128_bytes_while_busy(swept):
    swept.write("INIT;*WAI")
    assert swept.instrument.listen(b"FREQ:STEP 1;" * 20) == 128
    assert swept.instrument.listen(b"x") == 0


def test_410_new_message_discards_unread_reply(controller):
    controller.write("*IDN?", "FREQ:STEP 123")
    status_after(controller, -410)
    assert controller.number("FREQ:STEP?") == 123


def test_410_a_half_read_reply(controller):
    controller.write("*IDN?")
    assert controller.instrument.talk(5).data == b"HEWLE"
    assert controller.ask("*OPT?") == '"1D2"'
    status_after(controller, -410)


def test_410_late_reply_is_interrupted_in_advance(swept):
    swept.write("INIT", "*OPC?", "FREQ:STEP 5")
    status_after(swept, -410)
    assert swept.number("FREQ:STEP?") == 5
    swept.run()
    assert swept.instrument.talk().state is TalkState.NOTHING


def test_420_talking_without_reply(controller):
    talk = controller.instrument.talk()
    assert (talk.state, talk.data, talk.end) == (TalkState.NOTHING, b"", False)
    assert status_after(controller, -420) == [-420]


def test_420_an_unfinished_question_is_dropped(controller):
    controller.write(b"*IDN?")
    assert controller.instrument.talk().state is TalkState.NOTHING
    status_after(controller, -420)
    assert controller.ask("*OPT?") == '"1D2"'


def test_reply_under_way_is_awaited_without_error(swept):
    swept.write("INIT", "*OPC?")
    assert swept.instrument.talk().state is TalkState.WAITING
    assert swept.read() == b"+1\n"
    assert swept.errors() == []


def test_430_both_queues_full(controller):
    message = ";".join(["*IDN?"] * 60) + "\n"
    rest = message.encode()
    while rest and (taken := controller.instrument.listen(rest)):
        rest = rest[taken:]
    assert rest == b""
    assert status_after(controller, -430) == [-430]
    assert controller.instrument.talk().state is TalkState.NOTHING
    controller.errors()
    assert controller.ask("*OPT?") == '"1D2"'


def test_queries_in_one_message_share_reply(controller):
    assert controller.ask("*OPT?;:FREQ:STEP 7;STEP?;:INST?") == '"1D2";+7.00000000000E+000;FFT'


def test_same_message_does_not_interrupt_late_reply(swept):
    assert swept.ask("INIT;*OPC?;*OPT?") == '+1;"1D2"'
    assert swept.errors() == []


def test_device_clear_empties_queues_frees_parser(swept):
    swept.write("SOUR:VOLT 2 VPK;:JUNK", "*ESE 255;*SRE 4", "INIT;*OPC;*WAI")
    swept.instrument.listen(b"*IDN?\n")
    swept.instrument.device_clear()
    assert swept.integer("*ESE?") == 255
    assert swept.integer("*SRE?") == 4
    assert swept.number("SOUR:VOLT?") == 2
    swept.run()
    assert not swept.instrument.status.standard_event & OPC
    assert swept.errors() == [-113]


def test_device_clear_forgets_an_unread_reply(controller):
    controller.write("*IDN?")
    controller.instrument.device_clear()
    assert controller.ask("*OPT?") == '"1D2"'
    assert controller.errors() == []


def test_device_clear_cancels_a_late_reply(swept):
    swept.write("INIT", "*OPC?")
    swept.instrument.device_clear()
    swept.run()
    assert swept.instrument.talk().state is TalkState.NOTHING


def test_group_trigger_is_refused_as_trg(swept):
    swept.instrument.trigger()
    assert swept.errors() == [-221]
    assert swept.refusal("*TRG") == [-221]
    assert swept.refusal("INST:SEL FFT;*TRG") == [-211]


def test_remote_and_local(controller):
    controller.instrument.remote = False
    controller.write("*CLS")
    assert controller.instrument.remote


def test_reply_ends_with_line_feed_and_eoi(controller):
    controller.write("*OPT?")
    talk = controller.instrument.talk()
    assert talk.data.endswith(b'"\n')
    assert talk.end
    controller.write("*OPT?")
    parts = [controller.instrument.talk(1) for _ in range(6)]
    assert [part.end for part in parts] == [False] * 5 + [True]


def test_reply_may_outlast_every_adapter_timeout(bench):
    now = [0.0]
    controller = bench("slow-reply:seconds=4,phase=prepare", clock=lambda: now[0])
    controller.write("*IDN?")
    for now[0] in (0.0, 3.0, 3.99):
        assert controller.instrument.talk().state is TalkState.WAITING
    now[0] = 4.0
    assert controller.instrument.talk().data.startswith(b"HEWLETT")


def test_empty_messages_are_no_messages(controller):
    controller.write("*IDN?", "", "\r", "  ")
    assert controller.read() is not None
    assert controller.errors() == []


def test_endless_message_uses_bounded_memory(controller):
    controller.write(b"FREQ:STAR '" + b"x" * 1_000_000)
    # From here on, as it is slow: what has grown counts with all that it holds.
    tracemalloc.start()
    try:
        controller.write(b"x" * 100_000 + b"'\n")
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept < 200_000
    assert controller.ask("*OPT?") == '"1D2"'
