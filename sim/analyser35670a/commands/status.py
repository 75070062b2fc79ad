"""Common commands and those of STATus: the IEEE 488.2 side of the language.

A table; what the bits mean stands in `status`.
"""

from __future__ import annotations

from collections.abc import Callable

from sim.analyser35670a.commands.registry import (
    Act,
    Answer,
    Arguments,
    Ask,
    Command,
    Hold,
    Later,
    Numbers,
    no_arguments,
)
from sim.analyser35670a.kinds import Switch, Text, Whole, show_integer
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.status import ALL_BITS, Register, StatusModel

__all__ = ["COMMANDS"]


def _value(attribute: str, high: int) -> tuple[Act, Ask]:
    """Command and query of a byte of the status model."""

    def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        kept = getattr(instrument.status, attribute)
        setattr(instrument.status, attribute, Whole(0, high).read(arguments, kept))
        return None

    def ask(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        no_arguments(arguments)
        return show_integer(getattr(instrument.status, attribute))

    return act, ask


def _query(read: Callable[[InstrumentCore], str]) -> Ask:
    def ask(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        no_arguments(arguments)
        return read(instrument)

    return ask


def _do(action: Callable[[InstrumentCore], Answer]) -> Act:
    def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        no_arguments(arguments)
        return action(instrument)

    return act


def _complete_later(instrument: InstrumentCore) -> Answer:
    """``*OPC?``: answered when nothing is pending; the wait can be cancelled."""
    return Later(instrument.operations.query())


def _wait(instrument: InstrumentCore) -> Answer:
    return Hold(lambda: not instrument.operations.pending)


def _calibrate(instrument: InstrumentCore) -> Answer:
    return Later(instrument.calibration.run_and_report())


def _self_test(instrument: InstrumentCore) -> Answer:
    return Later(instrument.after_a_while(instrument.choices.self_test_s, "+0"))


def _power_on_clear(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    instrument.status.power_on_clear = Switch().read(arguments, True)
    return None


def _pass_control(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """``*PCB``: taken, and never used."""
    Whole(0, 30).read(arguments[:1], 0)
    return None


def _options(instrument: InstrumentCore) -> str:
    return Text().show(instrument.options)


def _register(
    name: str, get: Callable[[StatusModel], Register], reads_clear: bool
) -> list[Command]:
    """The commands of one register set."""

    def condition(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        no_arguments(arguments)
        register = get(instrument.status)
        value = register.condition
        if reads_clear and instrument.choices.condition_reads_clear:
            register.put(value, False)
        return show_integer(value)

    def field(attribute: str) -> tuple[Act, Ask]:
        def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
            register = get(instrument.status)
            value = Whole(0, ALL_BITS).read(arguments, getattr(register, attribute))
            setattr(register, attribute, value)
            return None

        return act, _query(lambda i: show_integer(getattr(get(i.status), attribute)))

    commands = [
        Command(f"STATus:{name}:[EVENt]", None,
                _query(lambda i: show_integer(get(i.status).take_event()))),
        Command(f"STATus:{name}:ENABle", *field("enable")),
    ]  # fmt: skip
    if name != "USER":
        commands += [
            Command(f"STATus:{name}:CONDition", None, condition),
            Command(f"STATus:{name}:PTRansition", *field("positive")),
            Command(f"STATus:{name}:NTRansition", *field("negative")),
        ]
    return commands


def _pulse_user(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    instrument.status.user.pulse(Whole(0, ALL_BITS).read(arguments, 0))
    return None


def clear_status(instrument: InstrumentCore) -> None:
    """``*CLS``: event registers, error queue, and the wait of `*OPC`."""
    instrument.status.clear()
    instrument.errors.clear()
    instrument.cancel_completion()


COMMANDS = (
    Command("*CLS", _do(clear_status)),
    Command("*ESE", *_value("event_enable", 255)),
    Command("*ESR", None, _query(lambda i: show_integer(i.status.take_standard_event()))),
    Command("*IDN", None, _query(lambda i: i.choices.identity)),
    Command("*OPC", _do(lambda i: i.operations.request()), _do(_complete_later)),
    Command("*OPT", None, _query(_options)),
    Command("*PCB", _pass_control),
    Command("*PSC", _power_on_clear,
            _query(lambda i: show_integer(int(i.status.power_on_clear)))),
    Command("*RST", _do(lambda i: i.reset(after_reset=True))),
    Command("*SRE", *_value("request_enable", 255)),
    Command("*STB", None, _query(lambda i: show_integer(i.status.status_byte))),
    Command("*TST", None, _do(_self_test)),
    Command("*WAI", _do(_wait)),
    Command("*CAL", None, _do(_calibrate)),
    Command("CALibration:[ALL]", None, _do(_calibrate)),
    Command("STATus:PRESet", _do(lambda i: i.status.preset())),
    Command("STATus:USER:PULSe", _pulse_user),
    *_register("OPERation", lambda status: status.operation, False),
    *_register("QUEStionable", lambda status: status.questionable, True),
    *_register("QUEStionable:VOLTage", lambda status: status.voltage, False),
    *_register("QUEStionable:LIMit", lambda status: status.limit, True),
    *_register("DEVice", lambda status: status.device, True),
    *_register("USER", lambda status: status.user, False),
)  # fmt: skip
