"""Commands of CALCulate, TRACe, FORMat and the units of DISPlay: what is shown and how it is read.

A table; the data come from `traces`, their coordinates from `coordinates`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.analyser35670a.commands.registry import Answer, Arguments, Command, Numbers, no_arguments
from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Number, Pick, Quoted, Switch, Text, show_integer, show_real
from sim.analyser35670a.measuring.coordinates import (
    VOLT_FEEDS,
    Picture,
    encode,
    in_volts,
    transform,
    unit_of,
)
from sim.analyser35670a.measuring.traces import check_feed, initial_feed, initial_sine_feed
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode, Scope, Setting
from sim.analyser35670a.units import FREQUENCY, PERCENT, Quantity

__all__ = ["COMMANDS", "SETTINGS"]

_FORMS = (
    "MLINear", "MLOGarithmic", "PHASe", "REAL", "IMAGinary", "NYQuist", "UPHase", "GDELay",
    "POLar",
)  # fmt: skip
_PAIRED = ("NYQ", "POL")
_VOLTS = Quoted(("V", "V2", "V/RTHZ", "V2/HZ", "V2S/HZ"))


def _number_format(instrument: InstrumentCore) -> tuple[str, int]:
    kind, size = str(instrument.settings.get("FORM")).split(",")
    return kind, int(size)


class TransferFormat:
    """Kind of ``FORM``: REAL,32 or 64, or ASC,3 to 12."""

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """Kind and size, the size optional."""
        if not arguments:
            raise ScpiError(-109)
        if len(arguments) > 2:
            raise ScpiError(-104)
        kind = Pick(("ASCii", "REAL")).read(arguments[:1], kept)
        size = 12.0 if kind == "ASC" else 64.0
        if len(arguments) == 2:
            if arguments[1].kind != "number":
                raise ScpiError(-120)
            size = arguments[1].number
        if kind == "REAL" and size not in (32.0, 64.0):
            raise ScpiError(-224, "REAL format length is only 32 and 64.")
        if kind == "ASC" and not 3 <= size <= 12:
            raise ScpiError(-222, "Out of range: value not changed.")
        return f"{kind},{round(size)}"

    def show(self, value: Any) -> str:
        """As in ``REAL,+64``."""
        kind, size = str(value).split(",")
        return f"{kind},{show_integer(int(size))}"


# Traces


def _form(instrument: InstrumentCore, trace: int) -> tuple[str, bool]:
    form = instrument.traces.effective(trace, "CALC#:FORM")
    return form, instrument.traces.effective(trace, "CALC#:UNIT:ANGL") == "RAD"


def _shown(instrument: InstrumentCore, trace: int) -> NDArray[np.float64]:
    picture = instrument.traces.picture(trace)
    if (volts := _volts(instrument, trace)) and instrument.settings.mode is not Mode.SINE:
        spectrum = instrument.spectrum
        picture = in_volts(picture, volts, spectrum.bandwidth_hz, spectrum.record_s)
    elif volts:
        picture = in_volts(picture, volts, 1.0, 1.0)
    values = transform(picture, *_form(instrument, trace))
    amplitude = instrument.traces.effective(trace, "CALC#:UNIT:AMPL")
    factor = {"PEAK": np.sqrt(2.0), "PP": 2.0 * np.sqrt(2.0)}.get(amplitude, 1.0)
    form = _form(instrument, trace)[0]
    if factor == 1.0 or picture.feed.partition(" ")[0] not in VOLT_FEEDS:
        return values
    if picture.power and form != "MLOG":
        factor *= factor
    if form == "MLOG":
        return np.where(values > -1e30, values + 20.0 * np.log10(factor), values)
    if form == "POL":
        values[0::2] *= factor
        return values
    return values if form in ("PHAS", "UPH", "GDEL") else values * factor


def _head(instrument: InstrumentCore, numbers: Numbers) -> str:
    feed = str(instrument.settings.get("CALC#:FEED", numbers[0]))
    if re.fullmatch(r"D\d", feed):
        register = instrument.traces.registers.get(int(feed[1]))
        feed = "" if register is None else register.feed
    return feed.partition(" ")[0]


def _volts(instrument: InstrumentCore, trace: int) -> str:
    """The unit of a spectrum in a trace; empty for other data."""
    head = _head(instrument, (trace,))
    if head not in VOLT_FEEDS:
        return ""
    return instrument.traces.effective(trace, "CALC#:UNIT:VOLT") or VOLT_FEEDS[head]


def _keep_volts(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    if not _volts(instrument, numbers[0]):
        raise ScpiError(-221, "Measurement data has no such unit.")
    chosen = _VOLTS.read(arguments, "")
    if instrument.settings.mode is Mode.SINE and chosen not in ("V", "V2"):
        raise ScpiError(-221, "Measurement data has no such unit.")
    old = _volts(instrument, numbers[0])
    instrument.settings.put("CALC#:UNIT:VOLT", chosen, *numbers)
    instrument.traces.change_over(numbers[0], "CALC#:UNIT:VOLT", old)
    return None


def _show_volts(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    head = _head(instrument, numbers)
    kept = str(instrument.settings.get("CALC#:UNIT:VOLT", *numbers))
    return f'"{kept or VOLT_FEEDS[head]}"' if head in VOLT_FEEDS else '""'


def _has_amplitude(instrument: InstrumentCore, numbers: Numbers) -> bool:
    head = _head(instrument, numbers)
    none = ("XFR:POW:COH", "XFR:POW:RAT", "XTIM:VOLT:CDF", "XTIM:VOLT:HIST", "XTIM:VOLT:PDF")
    return head not in (*none, "XFR:POW:VAR", "XRPM:PROF")


def _data(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    instrument.begin_read_out()
    return encode(_shown(instrument, numbers[0]), _number_format(instrument))


def _points(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return show_integer(len(instrument.traces.picture(numbers[0]).x))


def _x_data(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    instrument.begin_read_out()
    picture = instrument.traces.picture(numbers[0])
    return encode(_axis(instrument, picture), _number_format(instrument))


def _axis(instrument: InstrumentCore, picture: Picture) -> NDArray[np.float64]:
    return instrument.spectrum.shown_axis(picture.x) if picture.x_unit == "HZ" else picture.x


def _bottom(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """``DISP:TRAC:Y:BOTT?``, mostly asked for its unit."""
    trace = numbers[0]
    if arguments and arguments[0].text.upper() == "UNIT":
        form, radians = _form(instrument, trace)
        amplitude = instrument.traces.effective(trace, "CALC#:UNIT:AMPL")
        feed, volts = instrument.traces.picture(trace).feed, _volts(instrument, trace)
        return instrument.shown_unit(unit_of(feed, form, radians, amplitude, volts))
    no_arguments(arguments)
    return show_real(float(_shown(instrument, trace).min()))


def _keep_bottom(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    Number(-9.9e37, 9.9e37).read_free(arguments, Quantity(0.0))
    return None


# Registers


def _name(argument: Argument) -> tuple[str, int]:
    match = re.fullmatch(r"(TRAC|TRACE|D|W|CAL)(\d)", argument.text)
    if argument.kind != "word" or match is None:
        raise ScpiError(-141)
    kind, number = match.group(1), int(match.group(2))
    if not 1 <= number <= (8 if kind in "DW" else 4):
        raise ScpiError(-141)
    return ("TRAC" if kind == "TRACE" else kind), number


def _copy(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """``TRAC D1,TRAC1``, ``TRAC D1,D2`` or ``TRAC D1,<numbers or block>``."""
    if len(arguments) < 2:
        raise ScpiError(-109)
    kind, number = _name(arguments[0])
    if kind != "D":
        raise ScpiError(-141)
    source = arguments[1]
    if source.kind == "word" and len(arguments) > 2:
        raise ScpiError(-104)
    if source.kind == "word":
        origin, which = _name(source)
        traces = instrument.traces
        if origin == "TRAC":
            traces.registers[number] = traces.picture(which)
        elif origin == "D":
            traces.registers[number] = traces.register(which)
        else:
            raise ScpiError(-230)
        return None
    instrument.traces.replace(number, _numbers_sent(instrument, arguments[1:]))
    return None


def _numbers_sent(instrument: InstrumentCore, arguments: Arguments) -> NDArray[np.float64]:
    if arguments[0].kind == "block":
        kind, size = _number_format(instrument)
        width = size // 8
        if kind != "REAL" or len(arguments) > 1 or len(arguments[0].data) % width:
            raise ScpiError(-161)
        values = np.frombuffer(arguments[0].data, dtype=f">f{width}").astype(float)
        if not np.isfinite(values).all():
            raise ScpiError(-161)
        return values
    if any(argument.kind != "number" or argument.suffix for argument in arguments):
        raise ScpiError(-120)
    return np.array([argument.number for argument in arguments])


def _read_register(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    kind, number = _only_name(arguments)
    if kind == "W":
        raise ScpiError(-230)
    if kind != "D":
        raise ScpiError(-141)
    instrument.begin_read_out()
    return encode(instrument.traces.register(number).raw, _number_format(instrument))


def _only_name(arguments: Arguments) -> tuple[str, int]:
    if not arguments:
        raise ScpiError(-109)
    if len(arguments) > 1:
        raise ScpiError(-104)
    return _name(arguments[0])


def _register_x(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    picture = _picture_named(instrument, arguments)
    instrument.begin_read_out()
    return encode(_axis(instrument, picture), _number_format(instrument))


def _register_x_unit(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    return Text().show(_picture_named(instrument, arguments).x_unit)


def _picture_named(instrument: InstrumentCore, arguments: Arguments) -> Any:
    kind, number = _only_name(arguments)
    if kind == "TRAC":
        return instrument.traces.picture(number)
    if kind == "D":
        return instrument.traces.register(number)
    raise ScpiError(-230)


# Markers


def _marker_index(instrument: InstrumentCore, trace: int) -> int:
    x = instrument.traces.picture(trace).x
    return int(np.abs(x - instrument.settings.get("CALC#:MARK:X", trace).value).argmin())


def _marker_y(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    values = _shown(instrument, numbers[0])
    index = _marker_index(instrument, numbers[0])
    if _form(instrument, numbers[0])[0] in _PAIRED:
        return ",".join(show_real(float(value)) for value in values[2 * index : 2 * index + 2])
    return show_real(float(values[index]))


def _marker_to(pick: Callable[[NDArray[np.float64], int], int]) -> Any:
    def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        no_arguments(arguments)
        picture = instrument.traces.picture(numbers[0])
        values = _shown(instrument, numbers[0])
        if len(values) != len(picture.x):
            raise ScpiError(-200, "No Marker Functions allowed with NYQUIST or POLAR.")
        index = pick(values, _marker_index(instrument, numbers[0]))
        x = Quantity(float(picture.x[index]), picture.x_unit)
        instrument.settings.put("CALC#:MARK:X", x, *numbers)
        return None

    return act


def _left_peak(values: NDArray[np.float64], index: int) -> int:
    peaks = _peaks(values)
    earlier = peaks[peaks < index]
    return int(earlier.max()) if len(earlier) else index


def _right_peak(values: NDArray[np.float64], index: int) -> int:
    peaks = _peaks(values)
    later = peaks[peaks > index]
    return int(later.min()) if len(later) else index


def _peaks(values: NDArray[np.float64]) -> NDArray[np.intp]:
    inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
    return np.flatnonzero(inner) + 1


def _marker_point(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    return show_integer(_marker_index(instrument, numbers[0]))


def _result(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """[S] No function is calculated, which 9.91E37 says; and no weighting was applied."""
    if arguments and arguments[0].text.upper() == "UNIT":
        return instrument.shown_unit("")
    no_arguments(arguments)
    weighted = instrument.settings.get("CALC#:MARK:FUNC", *numbers) == "WEIG"
    return show_real(0.0 if weighted else math.nan)


COMMANDS = (
    Command("CALCulate#:DATA", None, _data),
    Command("CALCulate#:DATA:HEADer:POINts", None, _points),
    Command("CALCulate#:X:DATA", None, _x_data),
    Command("TRACe:[DATA]", _copy, _read_register),
    Command("TRACe:X:[DATA]", None, _register_x),
    Command("TRACe:X:UNIT", None, _register_x_unit),
    Command("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:BOTTom", _keep_bottom, _bottom),
    Command("CALCulate#:MARKer:Y:[ABSolute]", None, _marker_y),
    Command("CALCulate#:MARKer:MAXimum:[GLOBal]", _marker_to(lambda v, _i: int(v.argmax()))),
    Command("CALCulate#:MARKer:MAXimum:LEFT", _marker_to(_left_peak)),
    Command("CALCulate#:MARKer:MAXimum:RIGHt", _marker_to(_right_peak)),
    Command("CALCulate#:MARKer:POSition:POINt", None, _marker_point),
    Command("CALCulate#:MARKer:FUNCtion:RESult", None, _result),
    Command("CALCulate#:UNIT:VOLTage", _keep_volts, _show_volts),
    Command("CALCulate#:LIMit:FAIL", None, lambda *_: "+0"),
)


def _initial_form(numbers: Numbers) -> str:
    return "MLOG" if numbers[0] in (1, 3) else "REAL"


SETTINGS = (
    Setting("FORMat:[DATA]", TransferFormat(), "ASC,12", Scope.SHARED),
    Setting("CALCulate#:FEED", Text(), {Mode.SINE: initial_sine_feed, None: initial_feed},
            check=check_feed, overlapped=True),
    Setting("CALCulate#:FORMat", Pick(_FORMS), _initial_form, overlapped=True),
    Setting("CALCulate#:UNIT:ANGLe", Pick(("DEGRee", "RADian")), "DEGR", overlapped=True),
    Setting("CALCulate#:UNIT:AMPLitude", Pick(("PEAK", "PP", "RMS")), "RMS", overlapped=True,
            applies=_has_amplitude),
    # Empty stands for the unit that the data come with; the command is above.
    Setting("CALCulate#:UNIT:VOLTage", _VOLTS, "", overlapped=True),
    Setting("CALCulate#:UNIT:X", Quoted(("HZ", "CPM", "ORD", "USER")), "HZ", overlapped=True),
    Setting("CALCulate#:ACTive", Pick(("A", "B", "C", "D", "AB", "CD", "ABCD")), "A"),
    Setting("CALCulate#:GDAPerture:APERture", Number(0.0, 20.0, PERCENT), Quantity(0.5, "PCT"),
            reset=Quantity(0.25, "PCT")),
    Setting("CALCulate#:MARKer:[STATe]", Switch(), True),
    Setting("CALCulate#:MARKer:X:[ABSolute]", Number(-9.9e37, 9.9e37, FREQUENCY),
            Quantity(0.0, "HZ")),
    Setting("CALCulate#:MARKer:POSition", Number(-9.9e37, 9.9e37, FREQUENCY),
            Quantity(0.0, "HZ")),
    Setting("CALCulate#:MARKer:MODE", Pick(("ABSolute", "RELative")), "ABS"),
    Setting("CALCulate#:MARKer:COUPled:[STATe]", Switch(), False),
    Setting("CALCulate#:MARKer:MAXimum:[GLOBal]:TRACk", Switch(), False),
)  # fmt: skip
