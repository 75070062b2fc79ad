"""Commands that run and keep the instrument: INSTrument, INITiate, ABORt, CALibration, SYSTem.

A table; what a measurement does stands in `measurement`.
"""

from __future__ import annotations

from sim.analyser35670a.commands.registry import (
    Answer,
    Arguments,
    Command,
    Hold,
    Numbers,
    no_arguments,
)
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Pick, Switch, Text, Whole, one_argument, show_integer
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode, Scope, Setting

__all__ = ["COMMANDS", "SETTINGS"]

_MODES = tuple(Mode)
_MODE_WORDS = Pick(("FFT", "OCTave", "ORDer", "SINE", "HISTogram", "CORRelation"))
_NEEDS = {
    Mode.SINE: ("1D2", "OPTION 1D2, Swept Sine Measurements not installed."),
    Mode.OCTAVE: ("1D1", "OPTION 1D1, Realtime Octave Measurements not installed."),
    Mode.ORDER: ("1D0", "OPTION 1D0, Computed Order Tracking not installed."),
}


def _enter(instrument: InstrumentCore, mode: Mode) -> None:
    option, text = _NEEDS.get(mode, ("", ""))
    if option and option not in instrument.installed:
        raise ScpiError(-200, text)
    if mode is not instrument.settings.mode:
        instrument.enter_mode(mode)


def _select(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    _enter(instrument, Mode(_MODE_WORDS.read(arguments, None)))
    return None


def _selected(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return instrument.settings.mode.value


def _select_number(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    present = _MODES.index(instrument.settings.mode)
    _enter(instrument, _MODES[Whole(0, 5).read(arguments, present)])
    return None


def _selected_number(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return show_integer(_MODES.index(instrument.settings.mode))


def _initiate(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """Start; ignored while continuous, and [S] while a measurement runs."""
    no_arguments(arguments)
    if not instrument.settings.get("INIT:CONT") and not instrument.measurement.running:
        instrument.measurement.start()
    return None


def _abort(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    instrument.measurement.stop()
    if instrument.settings.get("INIT:CONT"):
        instrument.measurement.start()
    return None


def _continuous(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """OFF pauses; ON goes on, or is refused."""
    on = Switch().read(arguments, False)
    if on:
        instrument.measurement.go_on()
    else:
        instrument.measurement.pause()
    instrument.settings.put("INIT:CONT", on)
    return None


def _is_continuous(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return show_integer(int(instrument.settings.get("INIT:CONT")))


def _calibration(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    word = one_argument(arguments)
    if word.kind == "word" and word.text == "ONCE":
        instrument.calibration.run()
        return None
    instrument.settings.put("CAL:AUTO", Switch().read(arguments, True))
    instrument.calibration.follow_setting()
    return None


def _calibrates(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return show_integer(int(instrument.settings.get("CAL:AUTO")))


def _error(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return instrument.errors.pop()


def _preset(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    instrument.errors.clear()
    instrument.status.clear()
    instrument.reset(after_reset=False)
    return None


def _restore(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    block = one_argument(arguments)
    if block.kind != "block":
        raise ScpiError(-161)
    instrument.restore(block.data)
    return None


def _state(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    data = instrument.settings.dump()
    length = str(len(data))
    return f"#{len(length)}{length}".encode("ascii") + data


def _power(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    if not Switch().read(arguments, True):
        instrument.switch_off()
    return None


def _show_message(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    instrument.message = Text().read(arguments, "")
    return None


def _long_test(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    ready = instrument.after_a_while(instrument.choices.self_test_s, "+0")
    return Hold(lambda: ready() is not None)


def _nothing(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return None


COMMANDS = (
    Command("INSTrument:[SELect]", _select, _selected),
    Command("INSTrument:NSELect", _select_number, _selected_number),
    Command("INITiate:[IMMediate]", _initiate),
    Command("INITiate:CONTinuous", _continuous, _is_continuous),
    Command("ABORt", _abort),
    Command("CALibration:AUTO", _calibration, _calibrates),
    Command("SYSTem:ERRor", None, _error),
    Command("SYSTem:VERSion", None, lambda *_: "1992.0"),
    Command("SYSTem:PRESet", _preset),
    Command("SYSTem:SET", _restore, _state),
    Command("SYSTem:POWer:STATe", _power, lambda *_: "+1"),
    Command("SYSTem:POWer:SOURce", None, lambda *_: "AC"),
    Command("SYSTem:BEEPer:[IMMediate]", _nothing),
    Command("SYSTem:FLOG:CLEar", _nothing),
    Command("DISPlay:ERRor", _show_message),
    Command("TEST:LONG", _long_test),
    Command("TEST:LONG:RESult", None, lambda *_: "+0"),
    Command("TEST:LOG:CLEar", _nothing),
)

# The two below are declared for their presets; the commands above read and write them.
SETTINGS = (
    Setting("INITiate:CONTinuous", Switch(), True, Scope.SHARED, reset=False),
    Setting("CALibration:AUTO", Switch(), True, Scope.SHARED, reset=False),
    Setting("SYSTem:KLOCk", Switch(), False, Scope.KEPT),
    Setting("SYSTem:BEEPer:STATe", Switch(), False, Scope.KEPT),
    Setting("SYSTem:FAN:[STATe]", Pick(("OFF", "FULL", "AUTO")), "AUTO", Scope.KEPT),
    Setting("SYSTem:KEY", Whole(-32767, 32767), 0, Scope.KEPT),
    Setting("SYSTem:COMMunicate:GPIB:[SELF]:ADDRess", Whole(0, 30), 11, Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:BAUD", Whole(300, 9600), 9600, Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:BITS", Whole(5, 8), 8, Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:SBITs", Whole(1, 2), 1, Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:PACE", Pick(("NONE", "XON")), "NONE",
            Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:PARity:[TYPE]", Pick(("NONE", "EVEN", "ODD")),
            "NONE", Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:[RECeive]:PARity:CHECk", Switch(), False, Scope.KEPT),
    Setting("SYSTem:COMMunicate:SERial:TRANsmit:PACE", Pick(("NONE", "XON", "DSR")), "NONE",
            Scope.KEPT),
)  # fmt: skip
