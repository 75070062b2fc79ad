"""Files as other programs write them, of one response that is known, after their documentation.

The response is a linear pair, anti-resonance at 40 Hz and resonance at 70 Hz. Each maker returns
the content of a file. Where a program states units in its header, the file must be read as it is;
where it does not, it must be refused with the options that say so.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO

import h5py
import numpy as np
from scipy.io import savemat

from daq.formats import NOTHING_TOLD, Reading

HERTZ = 20.0 + 0.5 * np.arange(181)


def gain_at(hertz):
    """The response: 0.5 times a zero at 40 Hz over a pole at 70 Hz."""
    s = 1j * hertz
    zero = s**2 + 2 * 0.03 * 40 * s + 40**2
    return 0.5 * zero / (s**2 + 2 * 0.05 * 70 * s + 70**2)


GAIN = gain_at(HERTZ)
DB, DEG, RAD = 20 * np.log10(np.abs(GAIN)), np.degrees(np.angle(GAIN)), np.angle(GAIN)


def rows(*columns, mark: str = ",", form: str = "{:.9g}") -> str:
    """Rows of a table, one for each frequency."""
    return "".join(
        mark.join(form.format(value) for value in row) + "\n" for row in zip(*columns, strict=True)
    )


@dataclass(frozen=True)
class ForeignFile:
    """A file of a program; where `told` is more than nothing, it is refused without."""

    program: str
    name: str
    content: bytes
    told: Reading = NOTHING_TOLD
    """What the file does not say."""
    phase: bool = True


def told(*columns: tuple[str, str], **changes) -> Reading:
    """What a person says of a file."""
    return Reading(columns=columns, **changes)


def _bode100(mark: str = ",", decimal: str = ".") -> str:
    names = ["Frequency (Hz)", "Trace 1: Gain: Real", "Trace 1: Gain: Imaginary",
             "Trace 1: Gain: Magnitude (dB)", "Trace 2: Gain: Real", "Trace 2: Gain: Imaginary",
             "Trace 2: Gain: Phase (°)"]  # fmt: skip
    text = mark.join(names) + "\n"
    body = rows(HERTZ, GAIN.real, GAIN.imag, DB, GAIN.real, GAIN.imag, DEG, mark=mark)
    return text + (body.replace(".", decimal) if decimal != "." else body)


def _bode100_2016() -> str:
    head = (
        "---Measurement Setup---\nDevice Type: Bode100\nSource Level (dBm): 4\nProbe CH1: 10:1\n\n"
    )
    names = "Frequency (Hz), TR1: Gain (Real), TR1: Gain (Imag), TR1: Gain (dB), TR2: Gain (Degree)"
    return head + names + "\n" + rows(HERTZ, GAIN.real, GAIN.imag, DB, DEG, mark=", ")


def _siglent() -> str:
    head = "".join(f"Setting {k},{k}\n" for k in range(24)) + "Model,SDS1104X-E\n\n"
    names = "Frequency(Hz),CH2 Amplitude(dB),CH2 Phase(Deg),CH3 Amplitude(dB),CH3 Phase(Deg)\n"
    return head + names + rows(HERTZ, DB, DEG, DB - 6, DEG)


def _waveforms() -> str:
    head = "#Digilent WaveForms Network Analyzer\n#Device Name: Discovery2\n#Steps: 181\n\n"
    names = "Frequency (Hz),Channel 1 Magnitude (dB),Channel 2 Magnitude (dB),Channel 2 Phase (deg)"
    return head + names + "\n" + rows(HERTZ, 0 * DB, DB, DEG)


def _moku() -> str:
    head = "% Moku:Lab Frequency Response Analyzer\n% 181 points, sweep 20 Hz to 110 Hz\n"
    names = "% Frequency (Hz), Channel 1 Magnitude (dB), Channel 1 Phase (deg)\n"
    return head + names + rows(HERTZ, DB, DEG, mark=", ")


def _keysight() -> str:
    names = "#, Frequency (Hz), Amplitude (Vpp), Gain (dB), Phase (°)\n"
    return names + rows(np.arange(1, 182), HERTZ, 0 * DB + 0.2, DB, DEG)


def _ltspice(polar: bool) -> str:
    pairs = [
        f"({db:.15e}dB,{deg:.15e}°)" if polar else f"{g.real:.15e},{g.imag:.15e}"
        for db, deg, g in zip(DB, DEG, GAIN, strict=True)
    ]
    lines = (f"{f:.15e}\t{p}\n" for f, p in zip(HERTZ, pairs, strict=True))
    return "Freq.\tV(out)/V(in)\n" + "".join(lines)


def _rew() -> str:
    head = "* Measurement data saved by REW V5.20\n* Source: 1\n* Format: 256k Log Swept Sine\n"
    return head + "* Freq(Hz) SPL(dB) Phase(degrees)\n" + rows(HERTZ, DB, DEG, mark=" ")


def _complex_rows(form: str) -> str:
    return "".join(form.format(f, g.real, g.imag) for f, g in zip(HERTZ, GAIN, strict=True))


def _german() -> str:
    text = "Messung;Getriebe 7\nDatum;03.11.2026\n\nFrequenz [Hz];Betrag [dB];Phase [°]\n"
    return text + rows(HERTZ, DB, DEG, mark=";").replace(".", ",")


def _units_line() -> str:
    return "Frequency\tMagnitude\tPhase\nHz\tdB\tdeg\n" + rows(HERTZ, DB, DEG, mark="\t")


def _scope_script() -> str:
    return "freq_hz,ch1_vpp,ch2_vpp,phase_deg\n" + rows(
        HERTZ, 0 * DB + 3.0, 3.0 * np.abs(GAIN), DEG
    )


def files() -> Iterable[ForeignFile]:
    """All files, each with the program that writes such ones."""
    three = told(("frequency_hz", "1"), ("gain_db", "2"), ("phase_deg", "3"))
    table = rows(HERTZ, DB, DEG, mark="\t")
    blanks = rows(HERTZ, DB, DEG, mark=" ", form="{:12.8g}")
    text: list[tuple[str, str, str, Reading]] = [
        ("Bode Analyzer Suite", "bode100.csv", _bode100(), NOTHING_TOLD),
        ("Bode Analyzer Suite, German", "bode100_de.csv", _bode100(";", ","), NOTHING_TOLD),
        ("Bode 100, older CSV", "bode100_2016.csv", _bode100_2016(), NOTHING_TOLD),
        ("LTspice, one step", "ltspice_step.txt",
         _ltspice(True).replace("\n", "\nStep Information: Hu=40  (Step: 1/1)\n", 1), NOTHING_TOLD),
        ("Rows that end in a separator", "ends.csv",
         "Frequency (Hz);Gain (dB);Phase (deg);\n"
         + rows(HERTZ, DB, DEG, mark=";").replace("\n", ";\n"), NOTHING_TOLD),
        ("Siglent SDS", "siglent.csv", _siglent(), Reading(profile="siglent-ch2")),
        ("Digilent WaveForms", "waveforms.csv", _waveforms(), Reading(profile="waveforms")),
        ("Moku FRA", "moku.csv", _moku(), NOTHING_TOLD),
        ("Keysight InfiniiVision FRA", "keysight.csv", _keysight(), NOTHING_TOLD),
        ("LTspice, polar", "ltspice.txt", _ltspice(True), NOTHING_TOLD),
        ("LTspice, cartesian", "ltspice_re.txt", _ltspice(False), NOTHING_TOLD),
        ("SR785 by netgpibdata", "sr785.txt",
         "# SR785 Measurement - Timestamp: 2026-11-03\n" + rows(HERTZ, DB, DEG, mark="    "),
         Reading(profile="sr785")),
        ("diaggui text", "tf.txt", blanks, Reading(profile="diaggui")),
        ("diaggui text, complex", "tf_re.txt", rows(HERTZ, GAIN.real, GAIN.imag, mark=" "),
         Reading(profile="diaggui-complex")),
        ("REW", "rew.txt", _rew(), Reading(as_guessed=True)),
        ("ARTA and others, .frd", "box.frd", "* ARTA\n" + table, three),
        ("Simcenter Testlab", "lms.txt",
         "Title\tFRF\nFrequency\tReal\tImag\nHz\tV/V\tV/V\n"
         + rows(HERTZ, GAIN.real, GAIN.imag, mark="\t"), NOTHING_TOLD),
        ("pyFRF by numpy.savetxt", "pyfrf.txt",
         _complex_rows("{:.18e} ({:+.18e}{:+.18e}j)\n"), Reading(profile="pyfrf")),
        ("numpy complex CSV", "complex.csv", "frequency_hz,H\n" + _complex_rows("{},{}{:+}j\n"),
         NOTHING_TOLD),
        ("MATLAB writematrix", "m.csv", rows(2 * np.pi * HERTZ, np.abs(GAIN), RAD),
         told(("frequency_rad_s", "1"), ("gain", "2"), ("phase_rad", "3"))),
        ("python-control table", "control.csv",
         "omega [rad/s],mag [abs],phase [rad]\n" + rows(2 * np.pi * HERTZ, np.abs(GAIN), RAD),
         NOTHING_TOLD),
        ("Excel, German", "excel.csv", _german(), NOTHING_TOLD),
        ("Origin, units in a line", "origin.txt", _units_line(), NOTHING_TOLD),
        ("Scope and generator script", "scope.csv", _scope_script(),
         told(("frequency_hz", "freq_hz"), ("input_vpp", "ch1_vpp"), ("output_vpp", "ch2_vpp"),
              ("phase_deg", "phase_deg"))),
        ("SIMPLIS", "simplis.txt", "freq Gain Phase\n" + rows(HERTZ, DB, DEG, mark=" "),
         Reading(as_guessed=True)),
        ("MLSSA", "mlssa.txt", '"Hz"  "Mag (dB)"       "deg"\n' + rows(HERTZ, DB, DEG, mark=", "),
         NOTHING_TOLD),
        ("Red Pitaya bode", "pitaya.csv",
         "Frequency [Hz], Amplitude [dB], Phase [deg]\n" + rows(HERTZ, DB, DEG, mark=", "),
         NOTHING_TOLD),
        ("Scopy network analyser", "scopy.csv",
         ";Scopy version,v1.4\n;Tool,Network Analyzer\n"
         "Frequency(Hz),Amplitude(dB),Phase(°)\n" + rows(HERTZ, DB, DEG), NOTHING_TOLD),
        ("FRA4PicoScope", "fra4pico.csv",
         "Frequency Log(Hz), Gain (dB), Phase (deg)\n"
            + rows(np.log10(HERTZ), DB, DEG, form="{:.12g}"),
         NOTHING_TOLD),
        ("Ono Sokki, kHz", "kilo.csv", "Freq (kHz),Mag (dB),Phase (deg)\n"
         + rows(HERTZ / 1e3, DB, DEG, form="{:.12g}"), NOTHING_TOLD),
    ]  # fmt: skip
    for program, name, content, reading in text:
        yield ForeignFile(program, name, content.encode("utf-8"), reading)
    utf16 = _german().replace("\n", "\r\n").encode("utf-16")
    yield ForeignFile("Excel, Unicode text", "unicode.txt", utf16)
    yield ForeignFile("Excel, UTF-8 with a mark", "mark.csv", b"\xef\xbb\xbf" + _german().encode())
    latin = _keysight().encode("cp1252")
    yield ForeignFile("Keysight, Windows code page", "cp1252.csv", latin)
    quoted = "\n".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) for line in _moku().splitlines()[2:]
    ).replace("% ", "")
    yield ForeignFile("Quoted cells", "quoted.csv", quoted.encode())
    magnitude = "Frequency (Hz),Gain (dB)\n" + rows(HERTZ, DB)
    yield ForeignFile("Magnitude alone", "magnitude.csv", magnitude.encode(), phase=False)


def dtt_xml(listed: bool = True, second: bool = False, averages: int = 20) -> bytes:
    """A file as diaggui saves it: a transfer function, a channel over itself, and coherences."""
    coherence = np.linspace(0.5, 0.999, len(HERTZ)).astype("<f4")
    channels = ["X1:SERVO-OUT", "X1:SERVO-IN"] + (["X1:SERVO-AUX"] if second else [])
    parts = ["<?xml version='1.0'?>\n<!DOCTYPE LIGO_LW [<!ELEMENT LIGO_LW ANY>]>\n<LIGO_LW>"]
    gains = [GAIN, np.ones_like(GAIN), 2 * GAIN][: len(channels)]
    for name, subtype, dtype, values in (
        ("Result[0]", 3 if listed else 0, "<c8", gains),
        ("Result[1]", 5 if listed else 2, "<f4", [coherence] * len(channels)),
    ):
        content = b"".join(np.asarray(part).astype(dtype).tobytes() for part in values)
        if listed:
            content = HERTZ.astype(dtype).tobytes() + content
        said = {"Subtype": subtype, "f0": 20, "df": 0.5, "N": 181, "M": len(channels),
                "Averages": averages, "ChannelA": "X1:SERVO-IN"}  # fmt: skip
        said |= {f"ChannelB[{k}]": channel for k, channel in enumerate(channels)}
        parts += [f'<LIGO_LW Name="{name}" Type="TransferFunction">']
        parts += [f'<Param Name="{key}">{value}</Param>' for key, value in said.items()]
        text = base64.encodebytes(content).decode()
        parts += [f'<Array><Stream Encoding="LittleEndian,base64">\n{text}</Stream></Array>']
        parts += ["</LIGO_LW>"]
    return "\n".join([*parts, "</LIGO_LW>"]).encode()


def text_58(numbers, form, even, points=None, abscissa="Hz", ordinate="NONE", third=(0, "", 0.0)):
    """A data set 58 in single precision, line by line as the format says."""
    cells = [f"{value:13.5E}" for value in numbers]
    rows = ["".join(cells[start : start + 6]) for start in range(0, len(cells), 6)]
    points = points or len(numbers)
    return "\n".join(
        [
            "    -1", "    58", *["test", "NONE", "NONE", "NONE", "NONE"],
            "    4         0    0         0       load        12  -3       motr         7   1",
            f"{form:10d}{points:10d}{int(even):10d}{20:13.5E}{0.5:13.5E}{third[2]:13.5E}",
            f"{18:10d}    0    0    0 {'Frequency':<20} {abscissa:<20}",
            f"{0:10d}    0    0    0 {'NONE':<20} {ordinate:<20}",
            f"{0:10d}    0    0    0 {'NONE':<20} {'NONE':<20}",
            f"{third[0]:10d}    0    0    0 {'NONE':<20} {third[1] or 'NONE':<20}",
            *rows, "    -1", "",
        ]
    )  # fmt: skip


def interleaved(gain=GAIN, hertz=None):
    parts = [gain.real, gain.imag] if hertz is None else [hertz, gain.real, gain.imag]
    return np.column_stack(parts).reshape(-1)


def binary_58(gain=GAIN, hertz=None, double=True, order="<", stated=None):
    """A data set 58b, whose closing -1 stands right behind the data."""
    fields = [] if hertz is None else [("x", f"{order}f4")]
    fields += [(part, f"{order}f{8 if double else 4}") for part in ("re", "im")]
    table = np.zeros(len(gain), fields)
    table["re"], table["im"] = gain.real, gain.imag
    if hertz is not None:
        table["x"] = hertz
    data = table.tobytes()
    head = text_58([], 6 if double else 5, hertz is None, points=len(gain)).encode()
    first = f"    58b{1 if order == '<' else 2:6d}     2          11"
    first += f"{len(data) if stated is None else stated:12d}     0     0           0           0\n"
    return head[:-7].replace(b"    58\n", first.encode()) + data + b"    -1\n"


def universal_58() -> bytes:
    """A function as text."""
    return text_58(interleaved(), 5, True, points=len(GAIN)).encode()


def universal_58b() -> bytes:
    """The same in binary."""
    return binary_58()


NAMED = told(("frequency_hz", "f"), ("gain_complex", "H"))
"""What must be said of `arrays`."""


def arrays(suffix: str) -> bytes:
    """A MATLAB or HDF5 file of variables f and H."""
    buffer = BytesIO()
    if suffix == "mat":
        savemat(buffer, {"f": HERTZ, "H": GAIN})
    else:
        with h5py.File(buffer, "w") as file:
            file["f"], file["H"] = HERTZ, GAIN
    return buffer.getvalue()
