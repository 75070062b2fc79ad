"""Commands of INPut and [SENSe]: channels, ranges, band, sweep.

A table; what the commands do stands in `frequency`, `inputs` and `sweep`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sim.analyser35670a.commands.registry import Answer, Arguments, Command, Numbers
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.inputs import InputRange
from sim.analyser35670a.kinds import Number, Pick, Switch, Text, Whole, show_real
from sim.analyser35670a.measuring.frequency import (
    GRID_HZ,
    band,
    check_manual,
    check_start,
    check_stop,
    get_centre,
    get_span,
    highest_hz,
    set_centre,
    set_span,
)
from sim.analyser35670a.measuring.sweep import measured_points
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import OTHER_MODES, SINE_ONLY, Mode, Scope, Setting
from sim.analyser35670a.units import (
    CYCLES_OR_SECONDS,
    FREQUENCY,
    NONE,
    PERCENT,
    RESOLUTION,
    SECONDS,
    SPAN,
    Quantity,
    UnitTable,
)

__all__ = ["COMMANDS", "SETTINGS"]

_LINES = (100.0, 200.0, 400.0, 800.0, 1600.0)
"""Of FFT mode; the guide ends at 800, the data sheet and clients know 1600."""
_OUT_OF_RANGE = "Out of range: value not changed."
_NO_WINDOW = (-221, "No WINDOW With SWEPT SINE InstrumentCore Mode.")
_UP_ONLY = (-200, "UP ONLY auto range not available in Swept Sine instrument mode.")
_FREQUENCY = Number(0.0, 115000.0, FREQUENCY)
_SPANNING = OTHER_MODES - {Mode.OCTAVE, Mode.CORRELATION} | SINE_ONLY
_FFT = frozenset({Mode.FFT})


def _check_input(instrument: InstrumentCore, numbers: Numbers, on: bool) -> bool:
    if numbers[0] == 1 and not on:
        raise ScpiError(-200, "Channel 1 input cannot be disabled.")
    return on


def _inputs_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    """Fewer channels reach higher, more reach less high: the band must still fit."""
    start, stop = band(instrument)
    highest = highest_hz(instrument)
    if stop > highest:
        instrument.settings.put("FREQ:STOP", Quantity(highest, "HZ"))
        if start >= highest:
            instrument.settings.put("FREQ:STAR", Quantity(GRID_HZ, "HZ"))


def _check_resolution(instrument: InstrumentCore, numbers: Numbers, asked: Quantity) -> Quantity:
    if instrument.settings.mode is Mode.SINE:
        logarithmic = instrument.settings.get("SWE:SPAC") == "LOG"
        measured_points(asked, *band(instrument), logarithmic)
        return asked
    if asked.unit:
        raise ScpiError(-131)
    if not 1.0 <= asked.value <= _LINES[-1]:
        raise ScpiError(-222, _OUT_OF_RANGE)
    return Quantity(min(lines for lines in _LINES if lines >= asked.value))


def _check_dwell(instrument: InstrumentCore, numbers: Numbers, asked: Quantity) -> Quantity:
    """Whole cycles, at least one; less counts as one. [S] Rounded to the nearest."""
    if asked.unit == "S":
        if not 250e-6 <= asked.value <= 32768.0:
            raise ScpiError(-222, _OUT_OF_RANGE)
        return asked
    if not 0.0 <= asked.value <= instrument.choices.most_cycles:
        raise ScpiError(-222, _OUT_OF_RANGE)
    return Quantity(float(max(1, round(asked.value))), asked.unit)


def _spacing_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    """Units that the new spacing lacks give way to points per sweep."""
    for key in ("FREQ:RES", "FREQ:RES:AUTO:MIN"):
        lost = ("HZ",) if instrument.settings.get("SWE:SPAC") == "LOG" else ("PNT/DEC", "PNT/OCT")
        if instrument.settings.get(key).unit in lost:
            instrument.settings.put(key, Quantity(101.0, "PNT/SWP"))


def _range_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    instrument.settings.put("VOLT#:RANG:AUTO", False, *numbers)


def _manual_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    """In a running continuous manual measurement the new point is measured at once."""
    if instrument.settings.get("SWE:MODE") == "MAN" and instrument.settings.get("INIT:CONT"):
        instrument.measurement.start()


def _count_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    """More averages than were taken can be added to them; fewer cannot be taken back."""
    if instrument.settings.get("AVER:COUN") < instrument.spectrum.averaged:
        instrument.measurement.spoilt = True


def _start_bounds(instrument: InstrumentCore) -> tuple[float, float]:
    lowest = GRID_HZ if instrument.settings.mode is Mode.SINE else 0.0
    return lowest, highest_hz(instrument) - GRID_HZ


def _stop_bounds(instrument: InstrumentCore) -> tuple[float, float]:
    return _start_bounds(instrument)[0] + GRID_HZ, highest_hz(instrument)


def _frequency_command(
    pattern: str,
    units: UnitTable,
    get: Callable[[InstrumentCore], float],
    put: Callable[[InstrumentCore, Quantity], None],
) -> Command:
    """Command and query of a frequency that is derived from start and stop."""

    def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        low, high = _stop_bounds(instrument)
        step = instrument.settings.get("FREQ:STEP").value
        kind = Number(low, high, units, step)
        put(instrument, kind.read_free(arguments, Quantity(get(instrument), "HZ")))
        return None

    def ask(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        if arguments and arguments[0].text == "UNIT":
            return "HZ"
        return show_real(get(instrument))

    return Command(pattern, act, ask, modes=_SPANNING, measured=True)


def _full_span(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    instrument.settings.put("FREQ:STAR", Quantity(0.0, "HZ"))
    instrument.settings.put("FREQ:STOP", Quantity(highest_hz(instrument), "HZ"))
    return None


COMMANDS = (
    _frequency_command("[SENSe]:FREQuency:CENTer", FREQUENCY, get_centre, set_centre),
    _frequency_command("[SENSe]:FREQuency:SPAN", SPAN, get_span, set_span),
    Command("[SENSe]:FREQuency:SPAN:FULL", _full_span, modes=OTHER_MODES, measured=True),
)

_SWEPT: dict[str, Any] = {"modes": SINE_ONLY, "measured": True}
_POINTS = Number(0.0, 9.9e37, RESOLUTION, ranges={"PNT/SWP": (3.0, 801.0), "": (100.0, 1600.0)})
_TIME = Number(0.0, 9.9e37, CYCLES_OR_SECONDS)
_WORDS = (
    "PA", "G", "M/S2", "M/S", "M", "KG", "N", "DYN", "INCH/S2", "INCH/S", "INCH", "MIL", "LB",
    "USER",
)  # fmt: skip

SETTINGS = (
    # Channels
    Setting("INPut#:[STATe]", Switch(), lambda numbers: numbers[0] <= 2, Scope.SHARED,
            measured=True, check=_check_input, changed=_inputs_changed),
    Setting("INPut#:COUPling", Pick(("AC", "DC")), "DC", Scope.SHARED, measured=True),
    Setting("INPut#:LOW", Pick(("FLOat", "GROund")), "FLO", Scope.SHARED, measured=True),
    Setting("INPut#:BIAS:[STATe]", Switch(), False, Scope.SHARED, measured=True),
    Setting("INPut#:FILTer:[LPASs]:[STATe]", Switch(), True, Scope.SHARED, measured=True),
    Setting("INPut#:FILTer:AWEighting:[STATe]", Switch(), False, Scope.SHARED, measured=True,
            modes=OTHER_MODES),
    Setting("INPut#:REFerence:DIRection", Whole(0, 32767), 0, Scope.SHARED),
    Setting("INPut#:REFerence:POINt", Whole(0, 32767), 0, Scope.SHARED),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:[UPPer]", InputRange(), Quantity(-51.0, "DBVRMS"),
            measured=True, changed=_range_changed),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:AUTO", Switch(), True, measured=True),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:AUTO:DIRection", Pick(("UP", "EITHer")), "EITH",
            modes=OTHER_MODES, refusal=_UP_ONLY),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:UNIT:USER:[STATe]", Switch(), False),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:UNIT:USER:LABel", Text(4), "EU"),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:UNIT:USER:SFACtor",
            Number(-9.9e37, 9.9e37, UnitTable({"V/EU": ("V/EU", 1.0), "EU/V": ("EU/V", 1.0)},
                                              None)), Quantity(1.0, "V/EU")),
    Setting("[SENSe]:VOLTage#:[DC]:RANGe:UNIT:XDCR:LABel", Pick(_WORDS), "USER"),
    # Band
    Setting("[SENSe]:FREQuency:STARt", _FREQUENCY,
            {Mode.SINE: Quantity(51.2, "HZ"), None: Quantity(0.0, "HZ")}, measured=True,
            check=check_start, step_from="FREQ:STEP", bounds=_start_bounds),
    Setting("[SENSe]:FREQuency:STOP", _FREQUENCY, Quantity(51200.0, "HZ"), measured=True,
            check=check_stop, step_from="FREQ:STEP", bounds=_stop_bounds),
    Setting("[SENSe]:FREQuency:SPAN:LINK", Pick(("STARt", "CENTer")), "STAR", reset="CENT",
            modes=frozenset({Mode.FFT, Mode.SINE})),
    Setting("[SENSe]:FREQuency:STEP:[INCRement]", Number(GRID_HZ, 102400.0, FREQUENCY),
            Quantity(2000.0, "HZ"), modes=frozenset({Mode.FFT, Mode.SINE})),
    Setting("[SENSe]:FREQuency:MANual", Number(GRID_HZ, 51200.0, FREQUENCY),
            Quantity(51.2, "HZ"), modes=SINE_ONLY, check=check_manual,
            changed=_manual_changed, step_from="FREQ:STEP", bounds=band),
    Setting("[SENSe]:FREQuency:RESolution", _POINTS,
            {Mode.SINE: Quantity(101.0, "PNT/SWP"), None: Quantity(400.0)}, measured=True,
            modes=frozenset({Mode.FFT, Mode.SINE, Mode.CORRELATION}), check=_check_resolution),
    Setting("[SENSe]:FREQuency:RESolution:AUTO", Switch(), False, reset=True, **_SWEPT),
    Setting("[SENSe]:FREQuency:RESolution:AUTO:MCHange", Number(0.00391, 100.0, PERCENT),
            Quantity(2.0, "PCT"), **_SWEPT),
    Setting("[SENSe]:FREQuency:RESolution:AUTO:MINimum", _POINTS, Quantity(401.0, "PNT/SWP"),
            check=_check_resolution, **_SWEPT),
    Setting("[SENSe]:FREQuency:RESolution:OCTave", Pick(("THIRd", "FULL", "TWELfth")), "THIR",
            modes=frozenset({Mode.OCTAVE})),
    Setting("[SENSe]:FREQuency:BLOCksize", Whole(256, 4096), 1024,
            modes=frozenset({Mode.FFT, Mode.CORRELATION}), measured=True),
    # Sweep
    Setting("[SENSe]:SWEep:DIRection", Pick(("UP", "DOWN")), "UP", **_SWEPT),
    Setting("[SENSe]:SWEep:SPACing", Pick(("LINear", "LOGarithmic")), "LIN",
            changed=_spacing_changed, **_SWEPT),
    Setting("[SENSe]:SWEep:MODE", Pick(("AUTO", "MANual")), "AUTO", **_SWEPT),
    Setting("[SENSe]:SWEep:STIMe", _TIME, Quantity(5.0, "CYCLE"), **_SWEPT),
    Setting("[SENSe]:SWEep:DWELl", _TIME, Quantity(5.0, "CYCLE"), check=_check_dwell, **_SWEPT),
    Setting("[SENSe]:SWEep:OVERlap", Number(0.0, 99.0, PERCENT), Quantity(0.0, "PCT"),
            modes=OTHER_MODES, measured=True),
    Setting("[SENSe]:SWEep:TIME", Number(976.5625e-6, 8192.0, SECONDS), Quantity(7.8125e-3, "S"),
            modes=OTHER_MODES, measured=True),
    # Averaging and the rest
    Setting("[SENSe]:AVERage:IRESult:[STATe]", Switch(), False),
    Setting("[SENSe]:AVERage:IRESult:RATE", Whole(1, 9999999), 5, modes=OTHER_MODES),
    Setting("[SENSe]:AVERage:[STATe]", Switch(), False, modes=OTHER_MODES, measured=True),
    Setting("[SENSe]:AVERage:COUNt", Whole(1, 9999999), 10, modes=OTHER_MODES,
            changed=_count_changed),
    Setting("[SENSe]:AVERage:TYPE", Pick(("MAXimum", "RMS", "TIME", "VECTor", "ECONfidence")),
            "RMS", modes=OTHER_MODES, measured=True),
    Setting("[SENSe]:AVERage:TCONtrol", Pick(("FREeze", "REPeat", "EXPonential")), "FRE",
            modes=OTHER_MODES, measured=True),
    Setting("[SENSe]:AVERage:PREView", Pick(("OFF", "MANual", "TIMed")), "OFF", modes=_FFT),
    Setting("[SENSe]:AVERage:PREView:TIME", Number(0.1, 3600.0, SECONDS), Quantity(10.0, "S"),
            modes=_FFT),
    Setting("[SENSe]:AVERage:HOLD", Pick(("OFF", "MAXimum", "MINimum")), "OFF",
            modes=frozenset({Mode.OCTAVE})),
    Setting("[SENSe]:AVERage:IMPulse", Switch(), False, modes=frozenset({Mode.OCTAVE})),
    Setting("[SENSe]:AVERage:CONFidence", Number(0.25, 2.0, NONE), Quantity(0.5),
            modes=frozenset({Mode.OCTAVE})),
    Setting("[SENSe]:AVERage:TIME",
            Number(0.0, 9.9e37, UnitTable({"S": ("S", 1.0), "REC": ("REC", 1.0),
                                           "PNT": ("PNT", 1.0)}, None)),
            {Mode.HISTOGRAM: Quantity(1.0, "REC"), None: Quantity(0.125, "S")},
            modes=frozenset({Mode.OCTAVE, Mode.HISTOGRAM})),
    Setting("[SENSe]:REJect:STATe", Switch(), False, modes=frozenset({Mode.FFT, Mode.SINE})),
    Setting("[SENSe]:REFerence", Pick(("SINGle", "PAIR")), "SING", measured=True),
    Setting("[SENSe]:FEED", Pick(("INPut", "TCAPture")), "INP", modes=OTHER_MODES),
    Setting("[SENSe]:WINDow#:[TYPE]",
            Pick(("HANNing", "FLATtop", "UNIForm", "FORCe", "EXPonential", "LAG", "LLAG")), "FLAT",
            modes=OTHER_MODES, refusal=_NO_WINDOW, measured=True),
    Setting("[SENSe]:WINDow#:EXPonential", Number(3.8147e-6, 9.9999e6, SECONDS),
            Quantity(9999.0, "S"), modes=OTHER_MODES, refusal=_NO_WINDOW),
    Setting("[SENSe]:WINDow#:FORCe", Number(3.8147e-6, 9.9999e6, SECONDS),
            Quantity(9999.0, "S"), modes=OTHER_MODES, refusal=_NO_WINDOW),
    Setting("[SENSe]:WINDow#:ORDer:DC", Switch(), True, modes=OTHER_MODES, refusal=_NO_WINDOW),
    Setting("[SENSe]:HISTogram:BINS", Whole(4, 1024), 512, modes=frozenset({Mode.HISTOGRAM})),
    Setting("[SENSe]:ORDer:MAXimum", Number(3.125, 200.0), Quantity(10.0),
            modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:RESolution", Number(0.0078125, 1.0), Quantity(0.1),
            modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:RESolution:TRACk", Whole(1, 2048), 15, modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:RPM:MAXimum", Number(0.0, 9.9e37), Quantity(6000.0),
            modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:RPM:MINimum", Number(0.0, 9.9e37), Quantity(600.0),
            modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:TRACk#5", Number(0.0, 9.9e37),
            lambda numbers: Quantity(float(numbers[0])), modes=frozenset({Mode.ORDER})),
    Setting("[SENSe]:ORDer:TRACk#5:STATe", Switch(), False, modes=frozenset({Mode.ORDER})),
)  # fmt: skip
