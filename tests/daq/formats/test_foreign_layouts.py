"""Tables drawn at random, as people and programs write them: read rightly, or refused."""

import numpy as np
from foreign_files import GAIN, HERTZ
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.errors import InputError
from daq.formats import read_response

F, G = HERTZ[::6], GAIN[::6]
UNITS = {"Hz": 1.0, "kHz": 1e-3, "rad/s": 2.0 * np.pi}
NAMES = (
    ("Frequency", "Magnitude", "Phase", "Real", "Imag"),
    ("f", "|H|", "arg", "Re", "Im"),
    ("Frequenz", "Betrag", "Winkel", "Realteil", "Imaginärteil"),
    ("Freq", "Gain", "Phase", "real", "imag"),
)
LINES = (
    "Device: X1", "Date;03.11.2026", "Source level (V): 2.5", "Points,31", "# a comment", "",
    "% by hand", "Start\t20\tStop\t110", "1,2", "Bandwidth 3 5", "---", "Mode,Log,20,110",
)  # fmt: skip
FURTHER = (("Time", "s", 0.1 * np.arange(len(F))), ("Temperature", "K", 300.0 + 0.0 * F))


@st.composite
def tables(draw):
    """Bytes of a table of the response, and whether it says the phase."""
    names, unit = draw(st.sampled_from(NAMES)), draw(st.sampled_from(list(UNITS)))
    columns = [(names[0], unit, F * UNITS[unit])]
    family = draw(st.sampled_from(["parts", "dB", "lin"]))
    phase = family == "parts" or draw(st.booleans())
    if family == "parts":
        columns += [(names[3], "", G.real), (names[4], "", G.imag)]
    else:
        magnitude = np.abs(G)
        values = 20 * np.log10(magnitude) if family == "dB" else magnitude
        columns.append((names[1], family, values))
        if phase:
            angle = draw(st.sampled_from(["deg", "rad"]))
            turned = np.angle(G, deg=angle == "deg")
            columns.append((names[2], angle, turned))
    columns += draw(st.lists(st.sampled_from(FURTHER), max_size=1))
    columns = draw(st.permutations(columns))
    mark = draw(st.sampled_from([",", ";", "\t", " ", "|", ", "]))
    comma = mark not in (",", ", ") and draw(st.booleans())
    quoted = mark in (",", ";", "\t") and draw(st.booleans())
    form = draw(st.sampled_from(["{:.8g}", "{:.10f}", "{:.8e}"]))
    style = draw(st.sampled_from(["{} ({})", "{}[{}]", "{}/{}", "{}_{}", "below"]))

    def cell(text: str) -> str:
        return f'"{text}"' if quoted else text

    lines = draw(st.lists(st.sampled_from(LINES), max_size=5))
    apart = style == "below"
    heads = [name if apart or not unit else style.format(name, unit) for name, unit, _ in columns]
    lines.append(draw(st.sampled_from(["", "# ", "% "])) + mark.join(map(cell, heads)))
    if apart:
        lines.append(mark.join(cell(unit or "-") for _, unit, _ in columns))
    for row in range(len(F)):
        words = (form.format(values[row]) for _, _, values in columns)
        lines.append(mark.join(cell(w.replace(".", ",") if comma else w) for w in words))
    text = draw(st.sampled_from(["\n", "\r\n"])).join([*lines, ""])
    return text.encode(draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))), phase


@given(tables(), st.sampled_from([".csv", ".txt"]))
@settings(max_examples=20, deadline=None)
def test_any_table_layout_is_right_or_refused(tmp_path_factory, table, suffix):
    path = tmp_path_factory.mktemp("t") / f"t{suffix}"
    path.write_bytes(table[0])
    try:
        response = read_response(path)
    except InputError:
        return
    np.testing.assert_allclose(response.frequency_hz, F, rtol=1e-6)
    if np.any(response.phase_known):
        np.testing.assert_allclose(response.gain, G, rtol=1e-6, atol=1e-7)
    else:
        assert not table[1]
        np.testing.assert_allclose(np.abs(response.gain), np.abs(G), rtol=1e-6)


def test_most_layouts_are_read(tmp_path):
    read = tried = 0
    path = tmp_path / "t.csv"

    @given(tables())
    @settings(max_examples=25, deadline=None, derandomize=True, database=None)
    def count(table):
        nonlocal read, tried
        path.write_bytes(table[0])
        tried += 1
        try:
            read += len(read_response(path)) == len(F)
        except InputError:
            return

    count()
    assert read > 0.8 * tried
