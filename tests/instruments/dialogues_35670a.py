"""The 35670A's dialogues to the letter, in pieces, for the tests of the driver.

Written from the manuals' order of things; a change of the driver that sends
anything else, or leaves anything out, fails against them.
"""

from instruments.wire import Script

from daq.analyser import PointSettings
from daq.hp35670a import HP35670A

EMPTY = '> SYST:ERR?\n< +0,"No error"\n'
IDN = "HEWLETT-PACKARD,35670A,MY42509215,A.01.11"
IDENTIFY = f'! clear\n{EMPTY}> *IDN?\n< {IDN}\n> *OPT?\n< "1D2,1D3,UFF"\n'

ENTER = f"""
> *CLS
> STAT:PRES
> *ESE 61
> *SRE 32
{EMPTY}
> *RST
> *OPC
= 0
= 32
> *ESR?
< +1
; FFT mode is made harmless before it is left
> INIT:CONT OFF
> INST:SEL FFT
> SOUR:VOLT 0 VPK
> SOUR:VOLT:OFFS 0 V
> OUTP OFF
> INST:SEL?
< FFT
> SOUR:VOLT?
< +0.00000000000E+000
> SOUR:VOLT? UNIT
< VPK
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
> OUTP?
< +0
{EMPTY}
; the level that swept sine kept from earlier goes in the message that enters it
> INST:SEL SINE;:SOUR:VOLT 0 VPK;:SOUR:VOLT:OFFS 0 V;:INIT:CONT OFF
> SYST:ERR?
< -221,"Settings conflict; SOURCE LEVEL is 0 Volts, measurement paused."
{EMPTY}
> INST:SEL?
< SINE
> SOUR:VOLT?
< +0.00000000000E+000
> SOUR:VOLT? UNIT
< VPK
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
"""

CALIBRATE = f"""
> CAL:AUTO ONCE
> *OPC
= 96
> *ESR?
< +1
{EMPTY}
> STAT:QUES:COND?
< +0
"""

SET = f"""
> FREQ:SPAN 1 HZ
> FREQ:RES:AUTO OFF
> CAL:AUTO OFF
> INIT:CONT OFF
> FREQ:SPAN:LINK STAR
> INP1 ON
> INP1:COUP DC
> INP1:LOW FLO
> INP1:BIAS OFF
> INP1:FILT ON
> INP2 ON
> INP2:COUP DC
> INP2:LOW FLO
> INP2:BIAS OFF
> INP2:FILT ON
> SOUR:VOLT:AUTO OFF
> AVER:IRES OFF
> FORM REAL,64
> FREQ:STAR 50.01 HZ
> FREQ:STOP 200.01 HZ
> SWE:SPAC LIN
> SWE:MODE MAN
> FREQ:RES 401 PNT/SWP
> SWE:STIM 5 CYCLE
> SWE:DWEL 30 CYCLE
> SOUR:VOLT:SLEW 10 VPK/S
> VOLT1:RANG:AUTO ON
> VOLT2:RANG 2 VPK
> VOLT2:RANG:AUTO OFF
{EMPTY}
"""

READ_BACK = """
> FREQ:RES:AUTO?
< +0
> CAL:AUTO?
< +0
> INIT:CONT?
< +0
> FREQ:SPAN:LINK?
< STAR
> INP1?
< +1
> INP1:COUP?
< DC
> INP1:LOW?
< FLO
> INP1:BIAS?
< +0
> INP1:FILT?
< +1
> INP2?
< +1
> INP2:COUP?
< DC
> INP2:LOW?
< FLO
> INP2:BIAS?
< +0
> INP2:FILT?
< +1
> SOUR:VOLT:AUTO?
< +0
> AVER:IRES?
< +0
> FORM?
< REAL,+64
> FREQ:STAR?
< +5.00000000000E+001
> FREQ:STOP?
< +2.00015625000E+002
> SWE:SPAC?
< LIN
> SWE:MODE?
< MAN
> FREQ:RES?
< +4.01000000000E+002
> FREQ:RES? UNIT
< "PNT/SWP"
> SWE:STIM?
< +5.00000000000E+000
> SWE:STIM? UNIT
< CYCLE
> SWE:DWEL?
< +3.00000000000E+001
> SWE:DWEL? UNIT
< CYCLE
> SOUR:VOLT:SLEW?
< +1.00000000000E+001
> SOUR:VOLT:SLEW? UNIT
< VPK/S
> VOLT1:RANG:AUTO?
< +1
; 2 V peak is rounded up to the next step, and comes back in the unit that a bare number has
> VOLT2:RANG?
< +5.00000000000E+000
> VOLT2:RANG? UNIT
< DBVRMS
> VOLT2:RANG:AUTO?
< +0
"""

TRACES = """
> CALC1:FEED 'XFR:POW:RAT 2,1'
> CALC1:FORM MLOG
> CALC2:FEED 'XFR:POW:VAR 1'
> CALC2:FORM REAL
> CALC3:FEED 'XFR:POW:VAR 2'
> CALC3:FORM REAL
> *OPC
= 0
= 32
> *ESR?
< +1
> CALC1:FEED?
< "XFR:POW:RAT 2,1"
> CALC1:FORM?
< MLOG
> CALC2:FEED?
< "XFR:POW:VAR 1"
> CALC2:FORM?
< REAL
> CALC3:FEED?
< "XFR:POW:VAR 2"
> CALC3:FORM?
< REAL
"""

AXIS = """
> TRAC:X? TRAC1
# 50 100 150 200
> FREQ:STAR?
< +5.00000000000E+001
> FREQ:STOP?
< +2.00015625000E+002
"""

PREPARE = ENTER + CALIBRATE + SET + READ_BACK + TRACES + AXIS + EMPTY

# The level comes last, after the frequency and the offset.
DRIVE = f"""
> STAT:QUES:VOLT?
< +1
> STAT:DEV?
< +48
> *ESR?
< +0
> FREQ:MAN 100.3 HZ
> FREQ:MAN?
< +1.00296875000E+002
> SOUR:VOLT:OFFS 0 V
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
> SOUR:VOLT 2.5 VPK
> SOUR:VOLT?
< +2.50000000000E+000
> SOUR:VOLT? UNIT
< VPK
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
> SYST:ERR?
< -221,"Settings conflict; SOURCE LEVEL is 0 Volts, measurement paused."
{EMPTY}
"""

BEGIN = """
> FREQ:MAN 100.3 HZ
> FREQ:MAN?
< +1.00296875000E+002
> ABOR;:INIT;*OPC
= 0
= 96
> *ESR?
< +1
"""

STATUS = "> STAT:QUES:VOLT?\n< +0\n> STAT:QUES:VOLT:COND?\n< +768\n"

PICTURE = """
> TRAC D1,TRAC1
> TRAC? D1
# 0 0 0.3 -0.4 0 0 9.91e37 0
> CALC2:DATA?
# 0 0.0 0 0
> CALC3:DATA?
# 0 0.06 0 0
"""

# Level and offset are where they were put: another program's hand sets no bit.
UNMOVED = """
> SOUR:VOLT?
< +2.50000000000E+000
> SOUR:VOLT? UNIT
< VPK
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
"""

POINT = BEGIN + STATUS + PICTURE + "> STAT:DEV?\n< +32\n" + EMPTY + UNMOVED
QUIET = "> ABOR\n> SOUR:VOLT 0 VPK\n> SOUR:VOLT:OFFS 0 V\n"
END = QUIET + EMPTY

SETTINGS = PointSettings(2.5, 5, 30, input_range_vpk=(None, 2.0))


def driver(text: str, **options) -> tuple[HP35670A, Script]:
    script = Script(text)
    return HP35670A(script, **options), script


def prepared(text: str, **options) -> tuple[HP35670A, Script]:
    analyser, script = driver(PREPARE + text, **options)
    analyser.prepare(50.01, 200.01, SETTINGS)
    return analyser, script
