"""The rest of the language: commands that are understood and have no work to do here.

Owns settings that are checked, kept and answered but drive nothing in this
simulator (plotter, display, limits, markers' small print, programs), and
actions that are refused as an instrument without disk, plotter or option
refuses them. Nothing here touches the measurement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sim.analyser35670a.commands.registry import (
    Act,
    Answer,
    Arguments,
    Command,
    Numbers,
    no_arguments,
)
from sim.analyser35670a.commands.tokens import Argument
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import (
    Expression,
    Kind,
    Number,
    Pick,
    Quoted,
    Switch,
    Text,
    Whole,
    show_integer,
    show_real,
)
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import ALL_MODES, OTHER_MODES, Scope, Setting
from sim.analyser35670a.units import NONE, Quantity

__all__ = ["COMMANDS", "SETTINGS"]

_NO_CAPTURE = (-200, "Capture cannot be used with Inst Mode SWEPT SINE.")
_NO_WATERFALL = (-221, "No WATERFALL display with SWEPT SINE InstrumentCore Mode.")


@dataclass(frozen=True, slots=True)
class Series:
    """Several numbers with commas between."""

    least: int
    most: int
    low: float = -9.9e37
    high: float = 9.9e37

    def read(self, arguments: Sequence[Argument], kept: Any) -> str:
        """The numbers, as they are shown."""
        if len(arguments) < self.least:
            raise ScpiError(-109)
        if len(arguments) > self.most:
            raise ScpiError(-104)
        kind = Number(self.low, self.high, NONE)
        return ",".join(
            show_real(kind.read([argument], Quantity(0.0)).value) for argument in arguments
        )

    def show(self, value: Any) -> str:
        """As kept."""
        return str(value)


def _refuse(number: int, detail: str) -> Act:
    def act(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
        raise ScpiError(number, detail)

    return act


def _accept(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    """Something that leaves no trace here."""


_NO_DISK = _refuse(-252, "Disk not in drive")
_NO_PLOTTER = _refuse(-200, "Plotter/printer not responding.")
_NO_FIT = _refuse(-200, "Fit aborted. Trace A data invalid.")
_NO_DATA = _refuse(-230, "")
_NO_TRACE = _refuse(-200, "Limits are undefined.")


def _free(instrument: InstrumentCore, numbers: Numbers, arguments: Arguments) -> Answer:
    no_arguments(arguments)
    return f"{show_integer(1_000_000)},{show_integer(0)}"


_REGISTERS = Pick(tuple(f"D{n}" for n in range(1, 9)))
_PEN = Whole(0, 16)
_LINE = Pick(("SOLid", "DOTTed", "DASHed", *(f"STYLe{n}" for n in (0, *range(3, 13)))))
_ANY = Number(-9.9e37, 9.9e37)
_POSITIVE = Number(0.0, 9.9e37)
_FACTOR = Number(1e-15, 1e15)
_ZERO, _ONE = Quantity(0.0), Quantity(1.0)
_AXIS = Pick(("LINear", "LOGarithmic"))

_ROWS: tuple[tuple[str, Kind, Any], ...] = (
    ("CALCulate#:LIMit:BEEP:[STATe]", Switch(), False),
    ("CALCulate#:LIMit:STATe", Switch(), False),
    ("CALCulate#:LIMit:LOWer:SEGMent", Series(4, 400), ""),
    ("CALCulate#:LIMit:UPPer:SEGMent", Series(4, 400), ""),
    ("CALCulate#:MARKer:BAND:STARt", _ANY, _ZERO),
    ("CALCulate#:MARKer:BAND:STOP", _ANY, _ZERO),
    ("CALCulate#:MARKer:DTABle:X:INSert", _ANY, _ZERO),
    ("CALCulate#:MARKer:DTABle:X:LABel", Text(), ""),
    ("CALCulate#:MARKer:DTABle:X:SELect:[POINt]", Whole(1, 50), 1),
    (
        "CALCulate#:MARKer:FUNCtion",
        Pick(
            (
                "OFF", "HPOWer", "THD", "BPOWer", "BRMS", "SPOWer", "OVERshoot", "RTIMe", "STIMe",
                "DTIMe", "SSLevel", "GMARgin", "PMARgin", "GCRossover", "PCRossover", "FREQuency",
                "DAMPing", "SINFo", "WEIGht", "TPOWer", "WPOWer"
            )
        ),
        "OFF",
    ),
    ("CALCulate#:MARKer:HARMonic:COUNt", Whole(0, 400), 20),
    ("CALCulate#:MARKer:HARMonic:FUNDamental", _ANY, _ZERO),
    ("CALCulate#:MARKer:REFerence:X", _ANY, _ZERO),
    ("CALCulate#:MARKer:REFerence:Y", _ANY, _ZERO),
    ("CALCulate#:MARKer:SIDeband:CARRier", _ANY, _ZERO),
    ("CALCulate#:MARKer:SIDeband:COUNt", Whole(0, 200), 10),
    ("CALCulate#:MARKer:SIDeband:INCRement", _ANY, _ZERO),
    ("CALCulate#:MARKer:X:RELative", Number(-102400.0, 102400.0), _ZERO),
    ("CALCulate#:MARKer:Y:RELative", Number(-150.0, 150.0), _ZERO),
    ("CALCulate#:MATH:CONStant#5", Series(1, 2), show_real(0.0) + "," + show_real(0.0)),
    ("CALCulate#:MATH:[EXPRession#5]", Expression(), ""),
    ("CALCulate#:MATH:SELect", Pick(("F1", "F2", "F3", "F4", "F5")), "F1"),
    ("CALCulate#:MATH:STATe", Switch(), False),
    (
        "CALCulate#:UNIT:DBReference",
        Quoted(("DBV", "DBM", "DBSPL", "DBUSER", "USER")),
        "DBV",
    ),
    ("CALCulate#:UNIT:DBReference:IMPedance", _FACTOR, Quantity(50.0)),
    ("CALCulate#:UNIT:DBReference:USER:LABel", Text(), "dBEU"),
    ("CALCulate#:UNIT:DBReference:USER:REFerence", _FACTOR, _ONE),
    (
        "CALCulate#:UNIT:MECHanical",
        Quoted(("G", "M/S2", "M/S", "M", "INCH/S2", "INCH/S", "INCH", "MILS")),
        "G",
    ),
    ("CALCulate#:UNIT:X:ORDer:FACTor", _FACTOR, _ONE),
    ("CALCulate#:UNIT:X:USER:FREQuency:FACTor", _FACTOR, _ONE),
    ("CALCulate#:UNIT:X:USER:FREQuency:LABel", Text(), "user"),
    ("CALCulate#:UNIT:X:USER:TIME:FACTor", _FACTOR, _ONE),
    ("CALCulate#:UNIT:X:USER:TIME:LABel", Text(), "user"),
    ("DISPlay:ANNotation:[ALL]", Switch(), True),
    ("DISPlay:BRIGhtness", Number(0.0, 1.0), _ONE),
    ("DISPlay:EXTernal:[STATe]", Switch(), False),
    ("DISPlay:FORMat", Pick(("SINGle", "ULOWer", "FBACk", "SUBL", "ULFB", "QUAD")), "ULOW"),
    ("DISPlay:GPIB:ECHO", Switch(), False),
    ("DISPlay:PROGram:KEY:BOX", Switch(), False),
    ("DISPlay:PROGram:KEY:BRACket", Switch(), False),
    ("DISPlay:PROGram:[MODE]", Pick(("OFF", "FULL", "UPPer", "LOWer")), "OFF"),
    ("DISPlay:PROGram:VECTor:BUFFer:[STATe]", Switch(), False),
    ("DISPlay:RPM:[STATe]", Switch(), False),
    ("DISPlay:SHOWall:[STATe]", Switch(), False),
    ("DISPlay:STATe", Switch(), True),
    ("DISPlay:TCAPture:ENVelope:[STATe]", Switch(), False),
    (
        "DISPlay:VIEW",
        Pick(
            (
                "TRACe", "MSTate", "MMEMory", "STABle", "CTABle", "FTABle", "TTABle", "MEMory",
                "OPTion", "CAPTure", "ISTate", "MESSage"
            )
        ),
        "TRAC",
    ),
    ("DISPlay:[WINDow#]:DTABle:[STATe]", Switch(), False),
    ("DISPlay:[WINDow#]:DTABle:MARKer:[STATe]", Switch(), False),
    ("DISPlay:[WINDow#]:LIMit:STATe", Switch(), False),
    ("DISPlay:[WINDow#]:POLar:CLOCkwise", Switch(), False),
    ("DISPlay:[WINDow#]:POLar:ROTation", Number(-360.0, 360.0), _ZERO),
    ("DISPlay:[WINDow#]:TRACe:APOWer:[STATe]", Switch(), False),
    ("DISPlay:[WINDow#]:TRACe:BPOWer:[STATe]", Switch(), False),
    ("DISPlay:[WINDow#]:TRACe:GRATicule:GRID:[STATe]", Switch(), True),
    ("DISPlay:[WINDow#]:TRACe:LABel", Text(), ""),
    ("DISPlay:[WINDow#]:TRACe:LABel:DEFault:[STATe]", Switch(), True),
    ("DISPlay:[WINDow#]:TRACe:X:[SCALe]:AUTO", Pick(("OFF", "ONCE", "ON")), "OFF"),
    ("DISPlay:[WINDow#]:TRACe:X:[SCALe]:LEFT", _ANY, _ZERO),
    ("DISPlay:[WINDow#]:TRACe:X:[SCALe]:RIGHt", _ANY, _ZERO),
    ("DISPlay:[WINDow#]:TRACe:X:SPACing", _AXIS, "LIN"),
    ("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:AUTO", Pick(("OFF", "ONCE", "ON")), "ON"),
    ("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:CENTer", _ANY, _ZERO),
    ("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:PDIVision", _POSITIVE, Quantity(10.0)),
    ("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:REFerence", Pick(("TOP", "CENTer", "BOTTom", "RANGe")),
     "TOP"),
    ("DISPlay:[WINDow#]:TRACe:Y:[SCALe]:TOP", _ANY, _ZERO),
    ("DISPlay:[WINDow#]:TRACe:Y:SPACing", _AXIS, "LIN"),
    ("HCOPy:DESTination", Text(), "SYST:COMM:GPIB:RDEV"),
    ("HCOPy:DEVice:LANGuage", Pick(("HPGL", "PCL", "PHPGL")), "HPGL"),
    ("HCOPy:DEVice:RESolution", Whole(1, 1200), 75),
    ("HCOPy:DEVice:SPEed", Whole(1, 100), 36),
    ("HCOPy:ITEM:FFEed:STATe", Switch(), False),
    ("HCOPy:ITEM:LABel:COLor", _PEN, 1),
    ("HCOPy:ITEM:LABel:STATe", Switch(), False),
    ("HCOPy:ITEM:LABel:TEXT", Text(), ""),
    ("HCOPy:ITEM:TDSTamp:FORMat", Pick(tuple(f"FORMat{n}" for n in range(1, 6))), "FORM1"),
    ("HCOPy:ITEM:TDSTamp:STATe", Switch(), False),
    ("HCOPy:ITEM:[WINDow#]:TRACe:COLor", _PEN, 1),
    ("HCOPy:ITEM:[WINDow#]:TRACe:GRATicule:COLor", _PEN, 1),
    ("HCOPy:ITEM:[WINDow#]:TRACe:LIMit:LTYPe", _LINE, "SOL"),
    ("HCOPy:ITEM:[WINDow#]:TRACe:LTYPe", _LINE, "SOL"),
    ("HCOPy:ITEM:[WINDow#]:TRACe:MARKer:COLor", _PEN, 1),
    ("HCOPy:PAGE:DIMensions:AUTO", Switch(), True),
    ("HCOPy:PAGE:DIMensions:USER:LLEFt", Series(2, 2, -32767, 32767), "+0,+0"),
    ("HCOPy:PAGE:DIMensions:USER:URIGht", Series(2, 2, -32767, 32767), "+0,+0"),
    ("HCOPy:PLOT:ADDRess", Whole(0, 30), 5),
    ("HCOPy:PRINt:ADDRess", Whole(0, 30), 1),
    ("HCOPy:TITLe#2", Text(), ""),
    ("HCOPy:SOURce", Pick(("ALL", "TRACe", "MARKer", "REFerence", "GRID")), "ALL"),
    ("MMEMory:DISK:ADDRess", Whole(0, 30), 0),
    ("MMEMory:DISK:UNIT", Whole(0, 3), 0),
    ("MMEMory:MSIS", Text(), "INT:"),
    ("MMEMory:NAME", Text(), ""),
    ("MMEMory:STORe:TRACe:FORMat", Pick(("SDF", "ASCii")), "SDF"),
    ("MMEMory:STORe:PROGram:FORMat", Pick(("ASCii", "BINary")), "ASC"),
    ("SYSTem:DATE", Series(3, 3, 0, 9999), "+1992,+1,+1"),
    ("SYSTem:TIME", Series(3, 3, 0, 60), "+0,+0,+0"),
)  # fmt: skip

_FITTING: tuple[tuple[str, Kind, Any], ...] = (
    ("CALCulate#:CFIT:DESTination", _REGISTERS, "D1"),
    ("CALCulate#:CFIT:FREQuency:[AUTO]", Switch(), True),
    ("CALCulate#:CFIT:FREQuency:STARt", Number(0.0, 114999.9023), _ZERO),
    ("CALCulate#:CFIT:FREQuency:STOP", Number(0.390625, 115000.0), Quantity(51200.0)),
    ("CALCulate#:CFIT:FSCale", Number(1e-6, 1e6), _ONE),
    ("CALCulate#:CFIT:ORDer:AUTO", Switch(), True),
    ("CALCulate#:CFIT:ORDer:POLes", Whole(0, 20), 20),
    ("CALCulate#:CFIT:ORDer:ZERos", Whole(0, 20), 20),
    ("CALCulate#:CFIT:TDELay", Number(-100.0, 100.0), _ZERO),
    ("CALCulate#:CFIT:WEIGht:AUTO", Switch(), True),
    ("CALCulate#:CFIT:WEIGht:REGister", _REGISTERS, "D1"),
    ("CALCulate#:SYNThesis:DESTination", _REGISTERS, "D1"),
    ("CALCulate#:SYNThesis:FSCale", Number(1e-6, 1e6), _ONE),
    ("CALCulate#:SYNThesis:GAIN", _ANY, _ONE),
    ("CALCulate#:SYNThesis:SPACing", _AXIS, "LIN"),
    ("CALCulate#:SYNThesis:TDELay", Number(-100.0, 100.0), _ZERO),
    ("CALCulate#:SYNThesis:TTYPe", Pick(("PZERo", "PFRaction", "POLYnomial")), "PZER"),
)

_PROGRAMS: tuple[tuple[str, Kind, Any], ...] = (
    ("PROGram:EDIT:ENABle", Switch(), True),
    ("PROGram:[SELected]:MALLocate", Whole(1200, 500000), 1200),
    ("PROGram:[SELected]:NAME", Pick(tuple(f"PROGram{n}" for n in range(1, 6))), "PROG1"),
    ("PROGram:[SELected]:STATe", Pick(("STOP", "PAUSe", "RUN", "CONTinue")), "STOP"),
    ("PROGram:[SELected]:LABel", Text(18), ""),
)

_CAPTURE: tuple[tuple[str, Kind, Any], ...] = (
    ("[SENSe]:TCAPture:LENGth", _POSITIVE, _ONE),
    ("[SENSe]:TCAPture:FILE", Text(), ""),
    ("[SENSe]:TCAPture:STARt#", _POSITIVE, _ZERO),
    ("[SENSe]:TCAPture:STOP#", _POSITIVE, _ZERO),
    ("[SENSe]:TCAPture:TACHometer:RPM:MAXimum", Number(5.0, 491519.0), Quantity(6000.0)),
    ("[SENSe]:TCAPture:TACHometer:[STATe]", Switch(), False),
)

_WATERFALL: tuple[tuple[str, Kind, Any], ...] = (
    ("CALCulate#:WATerfall:COUNt", Whole(1, 32767), 1),
    ("CALCulate#:WATerfall:SLICe:SELect", _ANY, _ZERO),
    ("CALCulate#:WATerfall:SLICe:SELect:POINt", Whole(0, 2048), 0),
    ("CALCulate#:WATerfall:TRACe:SELect", _ANY, _ZERO),
    ("CALCulate#:WATerfall:TRACe:SELect:POINt", Whole(0, 32767), 0),
    ("DISPlay:[WINDow#]:WATerfall:[STATe]", Switch(), False),
    ("DISPlay:[WINDow#]:WATerfall:BASeline", Number(0.0, 100.0), _ZERO),
    ("DISPlay:[WINDow#]:WATerfall:BOTTom", _POSITIVE, _ZERO),
    ("DISPlay:[WINDow#]:WATerfall:COUNt", _POSITIVE, Quantity(20.0)),
    ("DISPlay:[WINDow#]:WATerfall:HEIGht", Number(1.0, 100.0), Quantity(50.0)),
    ("DISPlay:[WINDow#]:WATerfall:HIDDen", Switch(), False),
    ("DISPlay:[WINDow#]:WATerfall:SKEW", Switch(), False),
    ("DISPlay:[WINDow#]:WATerfall:SKEW:ANGLe", Number(-45.0, 45.0), _ZERO),
    ("DISPlay:[WINDow#]:WATerfall:TOP", _POSITIVE, _ZERO),
)


def _settings() -> tuple[Setting, ...]:
    plain = [Setting(pattern, kind, value, Scope.SHARED) for pattern, kind, value in _ROWS]
    groups = (
        (_FITTING, ALL_MODES, (0, ""), "1D3"),
        (_PROGRAMS, ALL_MODES, (0, ""), "1C2"),
        (_CAPTURE, OTHER_MODES, _NO_CAPTURE, ""),
        (_WATERFALL, OTHER_MODES, _NO_WATERFALL, ""),
    )
    for rows, modes, refusal, option in groups:
        plain += [
            Setting(pattern, kind, value, Scope.SHARED, modes=modes, refusal=refusal, option=option)
            for pattern, kind, value in rows
        ]
    return tuple(plain)


SETTINGS = _settings()

_ACTIONS: tuple[tuple[str, Act], ...] = (
    *((f"CALCulate#:LIMit:{side}:CLEar:[IMMediate]", _accept) for side in ("LOWer", "UPPer")),
    *((f"CALCulate#:LIMit:{side}:SEGMent:CLEar", _accept) for side in ("LOWer", "UPPer")),
    *((f"CALCulate#:LIMit:{side}:MOVE:Y", _NO_TRACE) for side in ("LOWer", "UPPer")),
    *((f"CALCulate#:LIMit:{side}:TRACe:[IMMediate]", _NO_TRACE) for side in ("LOWer", "UPPer")),
    ("CALCulate#:MARKer:DTABle:CLEar:[IMMediate]", _accept),
    ("CALCulate#:MARKer:DTABle:COPY#", _accept),
    ("CALCulate#:MARKer:DTABle:X:DELete", _accept),
    ("CALCulate#:WATerfall:SLICe:COPY", _NO_DATA),
    ("CALCulate#:WATerfall:TRACe:COPY", _NO_DATA),
    ("DISPlay:BODE", _accept),
    ("DISPlay:[WINDow#]:TRACe:X:MATCh#", _accept),
    ("DISPlay:[WINDow#]:TRACe:Y:MATCh#", _accept),
    ("HCOPy:COLor:DEFault", _accept),
    ("HCOPy:[IMMediate]", _NO_PLOTTER),
    ("MEMory:DELete:ALL", _accept),
    ("MEMory:DELete:[NAME]", _accept),
    ("[SENSe]:AVERage:PREView:ACCept", _accept),
    ("[SENSe]:AVERage:PREView:REJect", _accept),
    *(
        (f"MMEMory:{verb}", _NO_DISK)
        for verb in ("COPY", "DELete", "INITialize", "MDIRectory", "MOVE", "LOAD:CONTinue",
                     "STORe:CONTinue")
    ),
    *(
        (f"MMEMory:{verb}:{what}", _NO_DISK)
        for verb in ("LOAD", "STORe")
        for what in ("CFIT", "DTABle:TRACe#", "LIMit:LOWer:TRACe#", "LIMit:UPPer:TRACe#", "MATH",
                     "PROGram", "STATe", "SYNThesis", "TCAPture", "TRACe", "WATerfall")
    ),
)  # fmt: skip

_QUERIES: tuple[str, ...] = (
    "CALCulate#:LIMit:LOWer:REPort:[DATA]",
    "CALCulate#:LIMit:LOWer:REPort:YDATa",
    "CALCulate#:LIMit:UPPer:REPort:[DATA]",
    "CALCulate#:LIMit:UPPer:REPort:YDATa",
    "CALCulate#:MARKer:DTABle:[DATA]",
    "CALCulate#:MARKer:DTABle:X:[DATA]",
    "CALCulate#:MATH:DATA",
    "CALCulate#:WATerfall:[DATA]",
    "TRACe:WATerfall:[DATA]",
    "TRACe:Z:UNIT",
    "TRACe:Z:[DATA]",
    "[SENSe]:DATA",
    "[SENSe]:DATA:RANGe",
    "[SENSe]:DATA:HEADer:POINts",
    "[SENSe]:DATA:HEADer:FREQuency:STARt",
    "[SENSe]:DATA:HEADer:FREQuency:STOP",
)
"""Queries of things that are never there."""

COMMANDS = (
    *(Command(pattern, act) for pattern, act in _ACTIONS),
    *(Command(pattern, _NO_DATA, _NO_DATA) for pattern in _QUERIES),
    Command("MEMory:CATalog:[ALL]", None, _free),
    Command("MEMory:CATalog:NAME", None, _free),
    Command("MEMory:FREE:[ALL]", None, _free),
    Command("MMEMory:FSYStem", None, lambda *_: "LIF"),
    *(
        Command(f"CALCulate#:{what}", _NO_FIT, option="1D3")
        for what in ("CFIT:ABORt", "CFIT:COPY", "CFIT:[IMMediate]", "SYNThesis:COPY",
                     "SYNThesis:[IMMediate]")
    ),
    *(
        Command(f"CALCulate#:{what}:DATA", _NO_FIT, _NO_FIT, option="1D3")
        for what in ("CFIT", "SYNThesis")
    ),
    *(
        Command(f"PROGram:{what}", _refuse(-280, ""), _refuse(-280, ""), option="1C2")
        for what in ("EXPLicit:DEFine", "EXPLicit:LABel", "[SELected]:DEFine",
                     "[SELected]:NUMBer", "[SELected]:STRing")
    ),
    Command("PROGram:[SELected]:DELete:[SELected]", _accept, option="1C2"),
    Command("PROGram:[SELected]:DELete:ALL", _accept, option="1C2"),
    *(
        Command(f"[SENSe]:TCAPture:{what}", _refuse(-311, "Out Of Memory."), modes=OTHER_MODES,
                refusal=_NO_CAPTURE)
        for what in ("[IMMediate]", "MALLocate")
    ),
    Command("[SENSe]:TCAPture:ABORt", _accept, modes=OTHER_MODES, refusal=_NO_CAPTURE),
    Command("[SENSe]:TCAPture:DELete", _accept, modes=OTHER_MODES, refusal=_NO_CAPTURE),
)  # fmt: skip
