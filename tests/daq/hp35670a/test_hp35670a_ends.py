"""The driver against the simulated 35670A over every wire there is, in health and with faults."""

import threading
import time
from contextlib import closing, contextmanager

import numpy as np
import pytest

from daq.analyser import PointSettings, SourceState
from daq.errors import BenchTimeout, InstrumentError, LashbenchError, LinkError, ProtocolError
from daq.frf import PointFlag
from daq.hp35670a import HP35670A
from daq.hp35670a.setup import Timing
from daq.transports.open import open_transport
from sim.analyser35670a import Analyser35670A, Choices, LinearPlant
from sim.faults import FaultBoard, parse_fault
from sim.loopback import Loopback
from sim.serve import Server

SETTINGS = PointSettings(2.5, 5, 30, slew_vpk_per_s=200.0)
IMPATIENT = Timing(reply_s=0.4, block_s=0.8, overhead_s=0.5, margin=0.5)
WIRES = ("tcp", "prologix_tcp", "prologix_pty")


def gain(hz: float) -> complex:
    return 0.5 / (1 + 1j * hz / 100.0)


@contextmanager
def serving(*faults: str, **options):
    choices = options.pop("choices", Choices(calibration_s=0.5))
    board = FaultBoard([parse_fault(fault) for fault in faults])
    instrument = Analyser35670A(LinearPlant(gain), choices, board)
    with Server(
        instrument, realtime=False, tcp=0, prologix_tcp=0, prologix_pty=True, **options
    ) as server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield instrument, server.addresses
        finally:
            server.stop()
            thread.join()


def url_of(wire: str, addresses: dict[str, str]) -> str:
    if wire == "tcp":
        host, port = addresses["tcp"].split(":")
        return f"TCPIP::{host}::{port}::SOCKET"
    if wire == "prologix_tcp":
        return f"prologix-tcp:{addresses['prologix_tcp']}?addr=11"
    return f"prologix:{addresses['prologix_pty']}?addr=11"


def measured(analyser: HP35670A, frequencies=(60.0, 100.0, 150.0)) -> list:
    analyser.identify()
    analyser.prepare(50.0, 200.0, SETTINGS)
    return list(analyser.sweep(frequencies))


@pytest.mark.parametrize(
    ("wire", "dialect"),
    [
        ("tcp", "prologix"),
        ("prologix_tcp", "prologix"),
        ("prologix_tcp", "ar488"),
        ("prologix_pty", "prologix"),
        ("prologix_pty", "ar488"),
    ],
)
def test_response_is_equal_over_every_wire(wire, dialect):
    with serving(dialect=dialect) as (instrument, addresses):
        analyser = HP35670A(open_transport(url_of(wire, addresses)))
        points = measured(analyser)
        assert analyser.identify().simulated
        assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        analyser.close()
        assert instrument.output_vpk == 0.0
    for point in points:
        error_db = 20 * np.log10(abs(point.gain) / abs(gain(point.frequency_hz)))
        assert abs(error_db) < 5 * point.gain_std_db
        assert abs(np.degrees(np.angle(point.gain / gain(point.frequency_hz)))) < (
            5 * point.phase_std_deg
        )
        assert point.flags == PointFlag(0)


@pytest.mark.parametrize("seed", range(4))
def test_stated_error_is_that_of_simulated_noise(seed):
    choices = Choices(seed=seed, noise_v=5e-3)
    analyser = HP35670A(Loopback(Analyser35670A(LinearPlant(gain), choices)))
    points = measured(analyser, np.linspace(60.0, 190.0, 60))
    pulls = [
        20 * np.log10(abs(point.gain / gain(point.frequency_hz))) / point.gain_std_db
        for point in points
    ]
    # 60 draws: their standard deviation lies within 1 +- 0.28 in 99.8 % of all cases.
    assert 0.72 < np.std(pulls) < 1.28
    assert abs(np.mean(pulls)) < 0.5


def test_a_recorded_session_replays_without_an_instrument(tmp_path):
    path = tmp_path / "run.jsonl"
    with serving() as (_, addresses):
        url = url_of("prologix_tcp", addresses)
        analyser = HP35670A(open_transport(url, record=path))
        points = measured(analyser)
        state = analyser.make_safe()
        analyser.close()
    transport = open_transport(f"replay:{path}")
    replayed = HP35670A(transport)
    assert measured(replayed) == points
    assert replayed.make_safe() is state is SourceState.CONFIRMED_OFF
    assert transport.unused == 0


def test_replay_detects_other_settings(tmp_path):
    path = tmp_path / "run.jsonl"
    wire = Loopback(Analyser35670A(LinearPlant(gain)))
    analyser = HP35670A(open_transport("sim:", {"sim": lambda _: wire}, record=path))
    measured(analyser)
    analyser.close()
    replayed = HP35670A(open_transport(f"replay:{path}"))
    with pytest.raises(ProtocolError, match=r"has write 'FREQ:MAN 60 HZ', .* 'FREQ:MAN 61 HZ'"):
        measured(replayed, (61.0,))
    assert replayed.make_safe() is not SourceState.CONFIRMED_OFF


# On the box


@pytest.mark.parametrize("count", [401, 801])
@pytest.mark.parametrize("upward", [True, False])
def test_on_box_sweep_gives_every_point_once(count, upward):
    instrument = Analyser35670A(LinearPlant(gain), Choices(both_ends=True))
    analyser = HP35670A(Loopback(instrument), method="on-box")
    analyser.identify()
    analyser.prepare(50.0, 200.0, SETTINGS)
    asked = np.linspace(60.0, 160.0, count)[:: 1 if upward else -1]
    points = list(analyser.sweep(asked))
    assert [point.frequency_hz for point in points] == pytest.approx(list(asked), abs=1 / 64)
    worst = max(abs(point.gain - gain(point.frequency_hz)) for point in points)
    assert worst < 5e-3
    assert all(point.gain_std_db is not None for point in points)
    assert instrument.source.target_vpk == 0.0


def test_on_box_sweep_has_even_decades():
    analyser = HP35670A(Loopback(Analyser35670A(LinearPlant(gain))), method="on-box")
    analyser.identify()
    analyser.prepare(50.0, 200.0, SETTINGS)
    points = list(analyser.sweep(np.geomspace(60.0, 160.0, 401)))
    assert len(points) == 401
    ratio = np.diff(np.log([point.frequency_hz for point in points]))
    assert np.ptp(ratio) < 1e-9


def test_on_box_points_come_while_running():
    instrument = Analyser35670A(LinearPlant(gain))
    analyser = HP35670A(Loopback(instrument), method="on-box")
    analyser.identify()
    analyser.prepare(50.0, 200.0, SETTINGS)
    points = analyser.sweep(np.linspace(60.0, 160.0, 401))
    next(points)
    assert instrument.measurement.running
    assert 0 < instrument.measurement.points_begun < 100
    points.close()
    assert instrument.source.target_vpk == 0.0


def test_on_box_overload_flags_nearby_points_only():
    instrument = Analyser35670A(
        LinearPlant(gain), Choices(), FaultBoard([parse_fault("overload-burst:point=200")])
    )
    analyser = HP35670A(Loopback(instrument), method="on-box")
    analyser.identify()
    analyser.prepare(50.0, 200.0, SETTINGS)
    points = list(analyser.sweep(np.linspace(60.0, 160.0, 401)))
    flagged = [k for k, point in enumerate(points) if point.flags & PointFlag.OVERLOAD]
    assert 199 in flagged or 200 in flagged
    assert len(flagged) < 60


# Fixed ranges, offset


def test_an_unsuitable_fixed_range_is_flagged():
    analyser = HP35670A(Loopback(Analyser35670A(LinearPlant(gain))))
    analyser.identify()
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 5, 30, input_range_vpk=(3.0, 0.5)))
    (point,) = analyser.sweep([60.0])
    assert point.flags == PointFlag.OVERLOAD
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 5, 30, input_range_vpk=(3.0, 20.0)))
    (point,) = analyser.sweep([60.0])
    assert point.flags == PointFlag.HALF_RANGE_MISSED


def test_offset_is_driven_with_sweep_only():
    instrument = Analyser35670A(LinearPlant(gain))
    analyser = HP35670A(Loopback(instrument))
    analyser.identify()
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 5, 30, dc_offset_v=0.75))
    points = analyser.sweep([60.0, 61.0])
    next(points)
    assert instrument.source.offset_v == pytest.approx(0.75)
    points.close()
    assert instrument.settings.get("SOUR:VOLT:OFFS").value == 0.0


def test_plan_of_one_frequency_is_measured():
    analyser = HP35670A(Loopback(Analyser35670A(LinearPlant(gain))))
    analyser.identify()
    analyser.prepare(123.0, 123.0, SETTINGS)
    (point,) = analyser.sweep([123.0])
    assert abs(point.gain - gain(123.0)) < 1e-2


# Faults


@pytest.mark.parametrize(
    ("wire", "fault", "error", "state"),
    [
        ("tcp", "dropped-connection", LinkError, SourceState.UNKNOWN),
        ("prologix_tcp", "dropped-connection", LinkError, SourceState.UNKNOWN),
        ("prologix_pty", "dropped-connection", LinkError, SourceState.UNKNOWN),
        ("tcp", "slow-reply:phase=sweep,seconds=1.0", BenchTimeout, SourceState.CONFIRMED_OFF),
        ("tcp", "garbage-bytes", ProtocolError, SourceState.CONFIRMED_OFF),
        ("prologix_tcp", "garbage-bytes", ProtocolError, SourceState.CONFIRMED_OFF),
        ("tcp", "truncated-block", ProtocolError, SourceState.CONFIRMED_OFF),
        ("prologix_tcp", "truncated-block", ProtocolError, SourceState.CONFIRMED_OFF),
        ("prologix_tcp", "wrong-length", ProtocolError, SourceState.CONFIRMED_OFF),
        ("tcp", "stuck-measuring-bit", BenchTimeout, SourceState.CONFIRMED_OFF),
        ("prologix_tcp", "stuck-parser", BenchTimeout, SourceState.CONFIRMED_OFF),
        ("prologix_tcp", "adapter-reset", BenchTimeout, SourceState.CONFIRMED_OFF),
        ("tcp", "lost-power:seconds=0.2", InstrumentError, SourceState.CONFIRMED_OFF),
        ("tcp", "error-queue-overflow", InstrumentError, SourceState.CONFIRMED_OFF),
        ("tcp", "hardware-error", InstrumentError, SourceState.CONFIRMED_OFF),
        ("tcp", "calibration-failure", InstrumentError, SourceState.CONFIRMED_OFF),
        ("tcp", "missing-option", InstrumentError, SourceState.CONFIRMED_OFF),
    ],
)
def test_fault_gives_its_error_and_true_state(wire, fault, error, state):
    with (
        serving(fault) as (instrument, addresses),
        closing(HP35670A(open_transport(url_of(wire, addresses)), timing=IMPATIENT)) as analyser,
    ):
        started = time.monotonic()
        with pytest.raises(error) as raised:
            measured(analyser, np.linspace(60.0, 190.0, 8))
        if fault.startswith("slow-reply"):
            time.sleep(1.0)
        assert analyser.make_safe() is state
        assert (instrument.output_vpk == 0.0) is (state is SourceState.CONFIRMED_OFF)
        assert "\n" not in str(raised.value)
    assert time.monotonic() - started < 10.0


def test_reply_after_adapter_timeout_is_kept():
    # 1.2 s is more than two of the adapter's own time-outs, and less than the driver's.
    with serving("slow-reply:phase=sweep,seconds=1.2") as (instrument, addresses):
        analyser = HP35670A(open_transport(url_of("prologix_tcp", addresses)))
        assert len(measured(analyser)) == 3
        analyser.close()
        assert "No error" in instrument.errors.pop()


def test_overload_flags_its_point_only():
    with serving("overload-burst:point=3") as (_, addresses):
        analyser = HP35670A(open_transport(url_of("tcp", addresses)))
        points = measured(analyser, np.linspace(60.0, 190.0, 6))
        analyser.close()
    flagged = [bool(point.flags & PointFlag.OVERLOAD) for point in points]
    assert flagged == [False, False, True, False, False, False]


@pytest.mark.parametrize("wire", WIRES)
def test_same_wire_measures_again_after_fault(wire):
    with serving("garbage-bytes:point=2") as (_, addresses):
        analyser = HP35670A(open_transport(url_of(wire, addresses)), timing=IMPATIENT)
        with pytest.raises(LashbenchError):
            measured(analyser, np.linspace(60.0, 190.0, 5))
        assert len(measured(analyser)) == 3
        assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        analyser.close()


def test_driver_costs_under_five_milliseconds_per_point():
    costs = []
    for _ in range(3):
        analyser = HP35670A(Loopback(Analyser35670A(LinearPlant(gain))))
        analyser.identify()
        analyser.prepare(50.0, 200.0, SETTINGS)
        began = time.process_time()
        assert len(list(analyser.sweep(np.linspace(60.0, 190.0, 100)))) == 100
        costs.append((time.process_time() - began) / 100)
    # Processor time, instrument and all, so that a busy machine does not fail it.
    assert min(costs) < 5e-3
