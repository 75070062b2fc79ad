"""Commands of SOURce, OUTPut, TRIGger and ARM.

A table; what the source does stands in `source`.
"""

from __future__ import annotations

from typing import Any

from sim.analyser35670a.commands.registry import Answer, Arguments, Command, Numbers, no_arguments
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Number, Pick, Switch, Whole
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import OTHER_MODES, SINE_ONLY, Mode, Scope, Setting
from sim.analyser35670a.source import (
    HIGHEST_VPK,
    Amplitude,
    check_level,
    check_offset,
    fit_offset,
)
from sim.analyser35670a.units import (
    DECIBEL,
    FREQUENCY,
    LEVEL,
    PERCENT,
    RPM,
    SECONDS,
    SLEW,
    VOLT,
    Quantity,
    UnitTable,
)

__all__ = ["COMMANDS", "OUTPUT", "SETTINGS"]

OUTPUT = "OUTPut:[STATe]"
"""The one command whose existence in swept sine is a choice; see `Choices.output_in_sine`."""

_NO_TRIGGER = (-221, "No TRIGGER With SWEPT SINE InstrumentCore Mode.")
_UNTRIGGERED: dict[str, Any] = {"modes": OTHER_MODES, "refusal": _NO_TRIGGER}
_SWEPT: dict[str, Any] = {"modes": SINE_ONLY, "measured": True}
_REFERENCE = Amplitude(LEVEL, 10.0 ** (-69.276 / 20.0), 31.66)
_TRIGGER_LEVEL = UnitTable(
    {"V": ("V", 1.0), "MV": ("V", 1e-3), "VPK": ("V", 1.0), "PCT": ("PCT", 1.0)}, "V"
)


def _level_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    fit_offset(instrument)
    _source_changed(instrument, numbers)
    instrument.measurement.check_level()


def _source_changed(instrument: InstrumentCore, numbers: Numbers) -> None:
    instrument.refresh_source()


def _trigger(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """``*TRG``, ``TRIG:IMM`` and the group trigger: nothing here ever waits for one."""
    no_arguments(arguments)
    if instrument.settings.mode is Mode.SINE:
        raise ScpiError(*_NO_TRIGGER)
    raise ScpiError(-211, "Trigger received when not waiting for trigger.")


def _arm(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    raise ScpiError(-212, "Arm received when not waiting for arm.")


COMMANDS = (
    Command("*TRG", _trigger),
    Command("TRIGger:[IMMediate]", _trigger, **_UNTRIGGERED),
    Command("TRIGger:TACHometer:[RPM]", None, lambda *_: "+0.00000000000E+000", **_UNTRIGGERED),
    Command("ARM:[IMMediate]", _arm, **_UNTRIGGERED),
)

SETTINGS = (
    Setting("SOURce:VOLTage:[LEVel]:[IMMediate]:[AMPLitude]", Amplitude(LEVEL, 0.0, HIGHEST_VPK),
            Quantity(0.0, "VPK"), measured=True, check=check_level, changed=_level_changed),
    Setting("SOURce:VOLTage:[LEVel]:[IMMediate]:OFFSet", Number(-10.0, 10.0, VOLT, 1e-3),
            Quantity(0.0, "V"), measured=True, check=check_offset, changed=_source_changed),
    Setting("SOURce:VOLTage:SLEW", Number(0.0, 10000.0, SLEW), Quantity(0.0, "VPK/S"), **_SWEPT),
    Setting("SOURce:VOLTage:[LEVel]:AUTO", Switch(), False, **_SWEPT),
    Setting("SOURce:VOLTage:[LEVel]:REFerence", _REFERENCE, Quantity(2.0, "VPK"), **_SWEPT),
    Setting("SOURce:VOLTage:[LEVel]:REFerence:CHANnel",
            Pick(("INPut1", "INPut2", "INPut3", "INPut4")), "INP2", **_SWEPT),
    Setting("SOURce:VOLTage:[LEVel]:REFerence:TOLerance", Number(0.1, 20.0, DECIBEL),
            Quantity(2.0, "DB"), **_SWEPT),
    Setting("SOURce:VOLTage:LIMit:[AMPLitude]", Amplitude(LEVEL, 0.0, HIGHEST_VPK),
            Quantity(2.0, "VPK"), **_SWEPT),
    Setting("SOURce:VOLTage:LIMit:INPut", _REFERENCE, Quantity(2.0, "VPK"), **_SWEPT),
    Setting("SOURce:FREQuency:[CW]", Number(0.0, 115000.0, FREQUENCY), Quantity(10240.0, "HZ"),
            modes=OTHER_MODES, changed=_source_changed),
    Setting("SOURce:FUNCtion:[SHAPe]",
            Pick(("SINusoid", "RANDom", "BRANdom", "PCHirp", "BCHirp", "PINK", "USER", "CAPT")),
            "SIN", modes=OTHER_MODES),
    Setting("SOURce:BURSt", Number(0.0, 100.0, PERCENT), Quantity(50.0, "PCT"),
            modes=OTHER_MODES),
    Setting("SOURce:USER:[REGister]", Pick(tuple(f"D{n}" for n in range(1, 9))), "D1",
            modes=OTHER_MODES, option="1D4"),
    Setting("SOURce:USER:CAPTure", Whole(1, 4), 1, modes=OTHER_MODES, option="1D4"),
    Setting("SOURce:USER:REPeat", Switch(), True, modes=OTHER_MODES, option="1D4"),
    Setting(OUTPUT, Switch(), False, Scope.SHARED, modes=OTHER_MODES, changed=_source_changed),
    Setting("OUTPut:FILTer:[LPASs]:[STATe]", Switch(), True, Scope.SHARED),
    # Triggers and arms: kept, never waited for.
    Setting("TRIGger:SOURce",
            Pick(("IMMediate", "EXTernal", "INTernal1", "INTernal2", "INTernal3", "INTernal4",
                  "INTernal", "OUTPut", "BUS")), "IMM", **_UNTRIGGERED),
    Setting("TRIGger:SLOPe", Pick(("POSitive", "NEGative")), "POS", **_UNTRIGGERED),
    Setting("TRIGger:LEVel", Number(-9.9e37, 9.9e37, _TRIGGER_LEVEL), Quantity(0.0, "V"),
            **_UNTRIGGERED),
    Setting("TRIGger:STARt#", Number(-9.9e37, 9.9e37, SECONDS), Quantity(0.0, "S"),
            **_UNTRIGGERED),
    Setting("TRIGger:EXTernal:LEVel", Number(-10.0, 10.0, VOLT), Quantity(0.0, "V"),
            **_UNTRIGGERED),
    Setting("TRIGger:EXTernal:RANGe", Pick(("HIGH", "LOW")), "LOW", **_UNTRIGGERED),
    Setting("TRIGger:EXTernal:FILTer:[LPAS]:[STATe]", Switch(), False, **_UNTRIGGERED),
    Setting("TRIGger:TACHometer:HOLDoff", Number(0.0, 0.052224, SECONDS), Quantity(0.0, "S"),
            **_UNTRIGGERED),
    Setting("TRIGger:TACHometer:LEVel", Number(-20.0, 20.0, VOLT), Quantity(0.0, "V"),
            **_UNTRIGGERED),
    Setting("TRIGger:TACHometer:PCOunt", Number(0.5, 2048.0), Quantity(1.0), **_UNTRIGGERED),
    Setting("TRIGger:TACHometer:RANGe", Pick(("HIGH", "LOW")), "LOW", **_UNTRIGGERED),
    Setting("TRIGger:TACHometer:SLOPe", Pick(("POSitive", "NEGative")), "POS", **_UNTRIGGERED),
    Setting("ARM:SOURce", Pick(("IMMediate", "MANual", "RPM", "TIMer")), "IMM", **_UNTRIGGERED),
    Setting("ARM:TIMer", Number(0.0, 9.9e37, SECONDS), Quantity(1.0, "S"), **_UNTRIGGERED),
    Setting("ARM:RPM:INCRement", Number(1.0, 500000.0, RPM), Quantity(60.0, "RPM"),
            **_UNTRIGGERED),
    Setting("ARM:RPM:MODE", Pick(("OFF", "UP", "DOWN")), "OFF", **_UNTRIGGERED),
    Setting("ARM:RPM:THReshold", Number(5.0, 491520.0, RPM), Quantity(600.0, "RPM"),
            **_UNTRIGGERED),
)  # fmt: skip
