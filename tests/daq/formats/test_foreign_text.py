"""Tables of other programs: read by header, profile or option, or refused with the options."""

from pathlib import Path

import numpy as np
import pytest
from foreign_files import DB, DEG, GAIN, HERTZ, dtt_xml, files, rows, told
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.configs import config_names
from daq.errors import FileFormatError, InputError
from daq.formats import NOTHING_TOLD, Reading, foreign_layout, read_response
from daq.formats.foreign.profiles import load_profile
from daq.formats.reading import remarks_of

FILES = list(files())
TABLE = "Frequency (Hz);Gain (dB);Phase (deg)\n" + rows(HERTZ, DB, DEG, mark=";")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.program)
def test_program_file_is_right_or_names_option(file, tmp_path):
    path = tmp_path / file.name
    path.write_bytes(file.content)
    if file.told != NOTHING_TOLD:
        with pytest.raises(FileFormatError, match="--column") as caught:
            read_response(path)
        assert "\n" not in str(caught.value)
    response = read_response(path, file.told)
    np.testing.assert_allclose(response.frequency_hz, HERTZ, rtol=1e-6)
    if file.phase:
        np.testing.assert_allclose(response.gain, GAIN, rtol=1e-6)
    else:
        np.testing.assert_allclose(np.abs(response.gain), np.abs(GAIN), rtol=1e-6)
        assert not np.any(response.phase_known)
    assert any("as frequency_" in text for text in remarks_of(response))


def test_page_of_tested_files_names_all_programs():
    page = (Path(__file__).parents[3] / "docs" / "foreign-files.md").read_text()
    assert len(FILES) >= 30
    for file in FILES:
        assert f"| {file.program} |" in page


def test_every_profile_loads_with_title():
    for name in config_names("profiles"):
        assert load_profile(name).title


def read_text(tmp_path, text, reading=NOTHING_TOLD, name="x.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_response(path, reading)


@pytest.mark.parametrize(
    ("text", "quantity"),
    [
        ("freq,Gain,Phase\n" + rows(HERTZ, DB, DEG), "gain_db"),
        ("f,mag,ang\n" + rows(HERTZ, np.abs(GAIN), DEG), "gain"),
        (rows(HERTZ, DB, DEG), "gain_db"),
        (rows(HERTZ, DB), "gain_db"),
        ("Frequency (Hz),Gain (dB),Phase\n" + rows(HERTZ, DB, DEG), "phase_deg"),
        ("Frequency (Hz),Gain (dB),Phase\n" + rows(HERTZ, DB, np.radians(DEG)), "phase_rad"),
        ("Frequency (Hz),SPL (dB)\n" + rows(HERTZ, DB), "gain_db"),
    ],
)
def test_guess_is_used_only_when_confirmed(tmp_path, text, quantity):
    with pytest.raises(FileFormatError, match=f"by guess .* as {quantity}.*--as-guessed"):
        read_text(tmp_path, text)
    response = read_text(tmp_path, text, Reading(as_guessed=True))
    np.testing.assert_allclose(np.abs(response.gain), np.abs(GAIN), rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (TABLE.replace("\n25;", "\n25;;", 1), r"line 12: is no row of 3 numbers"),
        (TABLE.replace("\n25;", "\n25,0x;", 1), "line 12"),
        (TABLE.replace("\n25;", "\nend of part\n25;", 1), "line 12: is no row"),
        (TABLE + "100;1\n", "line 183"),
        (TABLE + "109;1;2\n", "line 183: frequency 109 Hz is out of order"),
        (TABLE + "110;1;2\n", "line 183: frequency 110 Hz comes twice"),
        (TABLE.replace("\n25;", "\n-25;", 1), "line 12: frequency -25 Hz is negative"),
        (TABLE.replace("\n25;-", "\n25;999", 1), "line 12: gain_db 999.* above the 200 dB"),
        (TABLE.replace("\n25;-", "\n25;;", 1).replace(";;", ";-;", 1), "line 12"),
        (TABLE.replace("Gain (dB)", "Gain (dBm)"), "column 2, 'Gain .dBm.', is in no known unit"),
        (TABLE.replace("Phase (deg)", "Gain 2 (dB)"), "several columns may be the gain"),
        (TABLE.replace("Gain (dB)", "Torque"), "no column is named as a response"),
        ("one\ntwo\n", "holds no table"),
        ("", "is empty"),
        (b"\x00\x01\x02\x03" * 50, "is not text"),
        ("1;2;3;4\n2;3;4;5\n", "4 columns without names"),
    ],
)
def test_table_with_any_fault_is_refused_whole(tmp_path, text, fault):
    with pytest.raises(FileFormatError, match=fault):
        read_text(tmp_path, text)


def test_a_negative_linear_magnitude_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match=r"magnitude of -17.5 is negative; if these are dec"):
        read_text(tmp_path, "Frequency (Hz),Gain (lin)\n" + rows(HERTZ, np.round(DB, 1)))


def test_rows_without_phase_are_read(tmp_path):
    line = next(line for line in TABLE.splitlines() if line.startswith("25;"))
    bare = ";".join(line.split(";")[:2])
    for empty in ("", "NaN", "--"):
        response = read_text(tmp_path, TABLE.replace(line, f"{bare};{empty}"))
        assert np.flatnonzero(~response.phase_known).tolist() == [10]
        np.testing.assert_allclose(np.abs(response.gain), np.abs(GAIN), rtol=1e-6)


def test_possible_thousands_separator_is_a_guess(tmp_path):
    rows_ = "".join(f"{k};{k},{100 + k}\n" for k in range(1, 9))
    with pytest.raises(FileFormatError, match="whether the comma in 1,101 is a decimal mark"):
        read_text(tmp_path, "Frequency (Hz);Gain (lin)\n" + rows_)


def test_falling_rows_are_reversed_with_a_note(tmp_path):
    text = "Frequency (Hz),Gain (dB),Phase (deg)\n" + rows(HERTZ[::-1], DB[::-1], DEG[::-1])
    response = read_text(tmp_path, text)
    np.testing.assert_allclose(response.gain, GAIN, rtol=1e-6)
    assert any("turned round" in said for said in remarks_of(response))
    down = read_text(tmp_path, text, Reading(direction="down"))
    np.testing.assert_allclose(down.gain[::-1], GAIN, rtol=1e-6)
    assert down.direction == "down"


def test_coherence_and_averages_give_error_bars(tmp_path):
    coherence = np.linspace(0.3, 1.0, len(HERTZ))
    text = "Frequency (Hz),Gain (dB),Phase (deg),Coherence\n" + rows(HERTZ, DB, DEG, coherence)
    plain = read_text(tmp_path, text)
    assert np.all(np.isnan(plain.gain_std_db))
    assert any("--averages N" in said for said in remarks_of(plain))
    response = read_text(tmp_path, text, Reading(averages=100))
    share = np.sqrt((1 - coherence[:-1]) / (200 * coherence[:-1]))
    np.testing.assert_allclose(response.gain_std_db[:-1], 20 / np.log(10) * share, rtol=1e-6)
    np.testing.assert_allclose(response.phase_std_deg[:-1], np.degrees(share), rtol=1e-6)
    assert np.isnan(response.gain_std_db[-1])
    with pytest.raises(FileFormatError, match="line 2: coherence 1.2 is not between"):
        read_text(tmp_path, text.replace(",0.3\n", ",1.2\n", 1), Reading(averages=100))


def test_measured_amplitudes_give_gain_not_levels(tmp_path):
    drive = 2.0 + 0.01 * np.sin(HERTZ)
    text = rows(HERTZ, drive, drive * np.abs(GAIN), DEG)
    first = ("frequency_hz", "1")
    with pytest.raises(FileFormatError, match="measured amplitudes are no levels"):
        read_text(tmp_path, text, told(first, ("source_vpk", "2"), ("gain", "3")))
    response = read_text(
        tmp_path,
        text,
        told(first, ("input_vrms", "2"), ("output_vrms", "3"), ("phase_deg", "4"), level_vpk=2.0),
    )
    np.testing.assert_allclose(response.gain, GAIN, rtol=1e-6)
    np.testing.assert_array_equal(response.levels_vpk, [2.0])


def test_level_column_is_converted_to_peak(tmp_path):
    text = "source_vrms,Frequency (Hz),Gain (dB)\n" + "".join(
        f"{level},{hertz},-3\n" for level in (1.0, 2.0) for hertz in (10, 20, 30, 40)
    )
    reading = told(("source_vrms", "1"))
    response = read_text(tmp_path, text, reading)
    np.testing.assert_allclose(response.levels_vpk, [2**0.5, 2 * 2**0.5])


@pytest.mark.parametrize(
    ("reading", "fault"),
    [
        (told(("gain_db", "9")), "has no column '9'"),
        (told(("gain_db", "Torque")), "has no column 'Torque'"),
        (told(("volts", "1")), "'volts' is no quantity"),
        (Reading(profile="bode100"), "has no response where the profile says"),
        (Reading(profile="nothing"), "was not found"),
        (Reading(function="2"), "--function says nothing of"),
        (Reading(averages=3), "has no coherence"),
    ],
)
def test_options_that_misfit_table_are_refused(tmp_path, reading, fault):
    with pytest.raises(InputError, match=fault):
        read_text(tmp_path, TABLE, reading)


def test_header_gain_alone_does_not_imply_decibels(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("freq,gain,phase\n" + rows(HERTZ, DB, DEG))
    layout = foreign_layout(path)
    assert [one.how for one in layout.assigned] == ["guessed"] * 3


def test_ascii_trace_of_35670a_keeps_its_abscissa(tmp_path):
    header = 'SDF_DATA_HDR   \ndataType      FREQ_RESP_DATA  \nxUnit.label   "Hz"  \n'
    (tmp_path / "T1.HDR").write_text(header)
    (tmp_path / "T1.X").write_text(rows(HERTZ, form="{:.10e}"))
    (tmp_path / "T1.TXT").write_text(rows(DB, form="{:.10e}"))
    with pytest.raises(FileFormatError, match="by guess"):
        read_response(tmp_path / "T1.TXT")
    response = read_response(tmp_path / "T1.TXT", Reading(profile="hp35670a-db"))
    np.testing.assert_allclose(np.abs(response.gain), np.abs(GAIN), rtol=1e-6)
    (tmp_path / "T1.HDR").write_text(header.replace("FREQ_RESP_DATA", "AUTO_PWR_DATA"))
    with pytest.raises(FileFormatError, match="AUTO_PWR_DATA"):
        read_response(tmp_path / "T1.TXT", Reading(profile="hp35670a-db"))
    (tmp_path / "T1.HDR").write_text(header)
    (tmp_path / "T1.X").write_text(rows(HERTZ[1:]))
    with pytest.raises(FileFormatError, match=r"has 181 rows of 1 and T1.X 180"):
        read_response(tmp_path / "T1.TXT", Reading(profile="hp35670a-db"))


@pytest.mark.parametrize("listed", [True, False])
def test_diaggui_transfer_function_keeps_its_coherence(tmp_path, listed):
    path = tmp_path / "tf.xml"
    path.write_bytes(dtt_xml(listed))
    response = read_response(path)
    np.testing.assert_allclose(response.gain, GAIN, rtol=1e-6)
    np.testing.assert_allclose(response.frequency_hz, HERTZ)
    assert response.provenance["gain_std_is"] == "error bar from coherence and 20 averages"
    assert np.all(response.gain_std_db > 0.0)
    path.write_bytes(dtt_xml(listed, second=True))
    with pytest.raises(FileFormatError, match="X1:SERVO-AUX/X1:SERVO-IN"):
        read_response(path)
    chosen = read_response(path, Reading(function="X1:SERVO-AUX/X1:SERVO-IN", averages=5))
    np.testing.assert_allclose(chosen.gain, 2 * GAIN, rtol=1e-6)
    assert chosen.provenance["gain_std_is"] == "error bar from coherence and 5 averages"


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (b"</LIGO_LW>", b"", "is not whole XML"),
        (b">181<", b">182<", "should have"),
        (b">181<", b">-1<", "is not a whole number"),
        (b"LittleEndian,base64", b"Text", "is encoded as 'text'"),
        (b"</Stream>", b"!</Stream>", "is damaged"),
        (b"LIGO_LW", b"HTML", "is XML of 'HTML'"),
    ],
)
def test_a_damaged_file_of_diaggui_is_refused(tmp_path, old, new, fault):
    path = tmp_path / "tf.xml"
    content = dtt_xml()
    assert old in content
    path.write_bytes(content.replace(old, new))
    with pytest.raises(FileFormatError, match=fault):
        read_response(path)


def test_expanding_xml_entities_are_refused(tmp_path):
    path = tmp_path / "bomb.xml"
    layers = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    path.write_text(f'<!DOCTYPE LIGO_LW [<!ENTITY l0 "ha">{layers}]><LIGO_LW>&l9;</LIGO_LW>')
    with pytest.raises(FileFormatError, match="bomb.xml"):
        read_response(path)


SMALL = ("Frequency (Hz);Gain (dB);Phase (deg)\n" + rows(HERTZ, DB, DEG, mark=";")[:900]).encode()
SMALL = SMALL[: SMALL.rindex(b"\n") + 1]


@given(st.integers(0, len(SMALL) - 1), st.integers(0, 40), st.binary(max_size=4))
@settings(max_examples=50, deadline=None)
def test_no_damage_halves_a_table(tmp_path_factory, start, length, put):
    path = tmp_path_factory.mktemp("d") / "d.csv"
    damaged = SMALL[:start] + put + SMALL[start + length :]
    path.write_bytes(damaged)
    said = ""
    try:
        count = len(read_response(path))
    except InputError as error:
        said, count = str(error), None
    assert "\n" not in said
    if count is not None:
        # Each line that is left but the header is a row: none was skipped.
        lines = [line for line in damaged.splitlines() if line.strip()]
        comments = sum(line.lstrip()[:1] in b"#%*;!'" for line in lines[1:])
        assert count >= len(lines) - 2 - comments
