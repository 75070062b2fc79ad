"""The CSV exchange format: what is kept, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.analyser import SweepPoint
from daq.errors import FileFormatError, InputError
from daq.formats import check_writable, read_response, write_response
from daq.frf import FrequencyResponse, PointFlag
from daq.plan import SweepPlan
from daq.store_records import MeasurementHeader

PRACTICE = sorted((Path(__file__).parents[2] / "data" / "practice").glob("*.csv"))
HEADER = "frequency_hz,source_vpk,gain_db,phase_deg,gain_std_db\n"
MEASURED = {"kind": "measured"}
GOOD = '# unit = "ADSS"\n' + HEADER + "100,1.5,-3,10,0.1\n101,1.5,-4,11,0.1\n102,1.5,-5,12,0.1\n"


def response(**changes):
    fields = {
        "frequency_hz": [100.0, 101.0, 102.0],
        "source_vpk": 1.5,
        "gain": [0.5 + 0.1j, 0.4, -0.2j],
        "unit": "ADSS",
    }
    return FrequencyResponse.from_arrays(**(fields | changes))


def refused(tmp_path, content):
    path = tmp_path / "bad.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FileFormatError) as caught:
        read_response(path)
    message = str(caught.value)
    assert "bad.csv" in message
    assert "\n" not in message
    assert caught.value.exit_code == 2
    return message


@pytest.mark.parametrize("path", PRACTICE, ids=lambda path: path.stem)
def test_practice_file_survives_a_write(path, tmp_path):
    original = read_response(path)
    rows = [line for line in path.read_text().splitlines() if line[:1].isdigit()]
    assert len(original) == len(rows) == 183
    first = [float(cell) for cell in rows[0].split(",")]
    assert original.frequency_hz[0] == first[0]
    assert original.source_vpk[0] == first[1]
    np.testing.assert_allclose(original.gain_db[0], first[2], rtol=1e-13)
    np.testing.assert_allclose(original.phase_deg[0], first[3], rtol=1e-13)
    assert original.gain_std_db[0] == first[4]
    assert (original.direction, original.settle_cycles, original.integrate_cycles) == ("up", 20, 30)

    write_response(original, tmp_path / "again.csv")
    assert_same(read_response(tmp_path / "again.csv"), original)


def assert_same(actual, expected):
    np.testing.assert_array_equal(actual.frequency_hz, expected.frequency_hz)
    np.testing.assert_array_equal(actual.source_vpk, expected.source_vpk)
    np.testing.assert_allclose(actual.gain, expected.gain, rtol=2e-13, atol=0)
    np.testing.assert_array_equal(actual.phase_known, expected.phase_known)
    np.testing.assert_array_equal(actual.gain_std_db, expected.gain_std_db)
    np.testing.assert_array_equal(actual.flags, expected.flags)
    for name in ("unit", "direction", "settle_cycles", "integrate_cycles", "from_rest"):
        assert getattr(actual, name) == getattr(expected, name)
    assert dict(actual.provenance) == dict(expected.provenance)


toml_values = st.recursive(
    st.booleans() | st.integers(-(2**60), 2**60) | st.text(max_size=8) | st.floats(allow_nan=False),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)
decimals = st.floats(-200, 100).map(lambda db: 10.0 ** (db / 20))


@st.composite
def responses(draw):
    direction = draw(st.sampled_from(["up", "down", None]))
    levels = draw(st.lists(st.floats(1e-3, 10), min_size=1, max_size=3, unique=True))
    # The last two are an analyser's own, on which what was asked for may fall twice.
    frequencies = st.floats(1e-3, 1e5) | st.sampled_from([50.0, 50.015625])
    grid = st.lists(frequencies, min_size=1, max_size=6)
    table = [
        (frequency, level)
        for level in levels
        for frequency in sorted(draw(grid), reverse=direction == "down")
    ]
    rows = len(table)

    def column(values):
        return draw(st.lists(values, min_size=rows, max_size=rows))

    known = np.array(column(st.booleans()))
    angle = np.where(known, column(st.floats(-180, 180, exclude_min=True)), 0.0)
    flags = st.sampled_from([0, 1, 2, 4, 8, 15])
    keys = st.text(max_size=6).filter(lambda key: key not in ("spoilt_points", "kind", "unit"))
    return FrequencyResponse.from_arrays(
        [row[0] for row in table],
        [row[1] for row in table],
        np.array(column(decimals)) * np.exp(1j * np.radians(angle)),
        phase_known=known,
        gain_std_db=column(st.just(math.nan) | st.floats(0, 50)),
        flags=column(flags),
        unit=draw(st.text(min_size=1, max_size=8)),
        direction=direction,
        settle_cycles=draw(st.none() | st.integers(0, 10**6)),
        integrate_cycles=draw(st.none() | st.integers(1, 10**6)),
        from_rest=draw(st.none() | st.booleans()),
        provenance={"kind": "simulated"} | draw(st.dictionaries(keys, toml_values, max_size=3)),
    )


@given(original=responses())
@settings(max_examples=40, deadline=None)
def test_writing_and_reading_lose_nothing(original, tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "response.csv"
    write_response(original, path)
    assert_same(read_response(path), original)


def test_a_swept_down_file_keeps_its_order(tmp_path):
    down = response(frequency_hz=[102.0, 101.0, 100.0], direction="down")
    write_response(down, tmp_path / "down.csv")
    assert read_response(tmp_path / "down.csv").frequency_hz.tolist() == [102.0, 101.0, 100.0]


@pytest.mark.parametrize("frequencies", [[100.0], [100.0, 101.0]])
def test_levels_of_few_points_are_kept(tmp_path, frequencies):
    few = response(frequency_hz=frequencies, gain=0.5 + 0.1j, provenance=MEASURED)
    write_response(few, tmp_path / "few.csv")
    assert_same(read_response(tmp_path / "few.csv"), few)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_repeated_frequency_keeps_both_readings(tmp_path, direction):
    path = tmp_path / "twice.csv"
    twice = [50.0, 50.015625, 50.015625, 50.03125][:: 1 if direction == "up" else -1]
    both = response(
        frequency_hz=twice, gain=[0.5, 0.4, 0.3, 0.2], direction=direction, provenance=MEASURED
    )
    write_response(both, path)
    assert_same(read_response(path), both)
    # Rows out of order stay a fault, and a file that does not say so has a row too many.
    text = path.read_text()
    first = next(line for line in text.splitlines() if line.startswith("50"))
    assert "out of order" in refused(tmp_path, text + first + "\n")
    silent = text.replace("# repeated_points = true\n", "")
    assert "repeated at source level 1.5 V; take one out" in refused(tmp_path, silent)


def test_only_repeated_frequencies_give_a_note(tmp_path):
    path = tmp_path / "once.csv"
    for frequencies, said in ([100.0, 101.0, 102.0], False), ([100.0, 101.0, 101.0], True):
        write_response(response(frequency_hz=frequencies), path)
        assert ("repeated_points" in path.read_text()) is said
    levels = response(frequency_hz=100.0 * np.ones(3), source_vpk=[1.0, 1.5, 2.0])
    write_response(levels, path)
    assert "repeated_points" not in path.read_text()


def test_grid_coarser_than_plan_can_be_exported(store, tmp_path):
    plan = SweepPlan((50.0, 50.01, 50.02), (1.5,))
    measurement = store.begin(MeasurementHeader("ADSS", "", plan, "sim:", "t"))
    for asked_hz, set_hz in zip(plan.frequencies_hz, (50.0, 50.015625, 50.015625), strict=True):
        store.add_point(measurement, 1.5, asked_hz, SweepPoint(set_hz, asked_hz - 1j))
    exported = tmp_path / "fine.csv"
    write_response(store.response(measurement), exported)
    read = read_response(exported)
    assert read.frequency_hz.tolist() == [50.0, 50.015625, 50.015625]
    np.testing.assert_allclose(read.gain.real, plan.frequencies_hz, rtol=1e-13)
    assert read.provenance["points"]["requested_hz"] == list(plan.frequencies_hz)


def test_levels_may_alternate_from_row_to_row(tmp_path):
    path = tmp_path / "mixed.csv"
    rows = [f"{f},{v},-3,,\n" for f in (10, 11, 12) for v in (1, 2)]
    path.write_text('# unit = "ADSS"\n' + HEADER + "".join(rows))
    read = read_response(path)
    assert read.levels_vpk.tolist() == [1.0, 2.0]
    assert not read.phase_known.any()
    assert np.isnan(read.gain_std_db).all()
    np.testing.assert_allclose(read.gain, 10 ** (-3 / 20))


def test_file_saved_by_spreadsheet_is_read(tmp_path):
    path = tmp_path / "bom.csv"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode() + b"\r\n\r\n")
    assert len(read_response(path)) == 3


def test_file_without_kind_counts_as_measured(tmp_path):
    path = tmp_path / "plain.csv"
    path.write_text("# operator = 'M. Rossi'\n" + GOOD)
    assert dict(read_response(path).provenance) == {"kind": "measured", "operator": "M. Rossi"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "empty"),
        ("  \n \n", "empty"),
        (b"\x00\x01\x02" * 50, "is not text"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "not text"),
        ('# unit = "ADSS"\n', "no header"),
        ('# unit = "ADSS"\n' + HEADER, "no rows"),
        ('# unit = "ADSS"\n100,1.5,-3,10,0.1\n', "no header"),
        (GOOD.replace("phase_deg", "phase_rad"), "phase_rad"),
        (GOOD.replace(",gain_std_db", ""), "gain_std_db is missing"),
        (GOOD.replace("gain_std_db", "gain_std_db,coherence"), "coherence"),
        (GOOD.replace("frequency_hz,source_vpk", "source_vpk,frequency_hz"), "out of order"),
        (HEADER + "100,1,-3,,\n101,1,-3,,\n102,1,-3,,\n", "names the unit"),
    ],
)
def test_file_without_frame_is_refused(tmp_path, content, said):
    assert said in refused(tmp_path, content)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("101,1.5,-4", "101,1.5,loud", "line 4: gain_db 'loud'"),
        ("101,1.5,-4", "101,1.5,nan", "line 4: gain_db 'nan'"),
        ("101,1.5,-4", "101,1.5,-inf", "line 4: gain_db '-inf'"),
        ("101,1.5,-4", "101,1.5,1e999", "line 4: gain_db '1e999'"),
        ("101,1.5,-4", "101,1.5,1e6", "line 4: gain_db 1e+06"),
        ("101,1.5,-4", "101,1.5,", "line 4: gain_db is empty"),
        ("101,1.5,-4", "1_01,1.5,-4", "line 4: frequency_hz '1_01'"),
        ("101,1.5,-4", "١٠١,1.5,-4", "line 4: frequency_hz"),  # noqa: RUF001
        ("101,1.5", "0,1.5", "line 4: frequency_hz 0"),
        ("100,1.5", "-100,1.5", "line 3: frequency_hz -100"),
        ("101,1.5", "101,0", "line 4: source_vpk 0"),
        ("101,1.5", "101,-1.5", "line 4: source_vpk -1.5"),
        ("12,0.1", "12,-0.1", "line 5: gain_std_db -0.1"),
        ("12,0.1", "12,inf", "line 5: gain_std_db 'inf'"),
        ("102,", "101,", "line 5: frequency_hz 101 is repeated"),
        ("102,", "100.5,", "line 5: frequency_hz 100.5 is out of order"),
        ("-5,12,0.1", "-5,12", "line 5: 4 values"),
        ("-5,12,0.1", "-5,12,0.1,7", "line 5: 6 values"),
        ("100,1.5,-3", "100,1,5,-3", "line 3: 6 values"),
        ("101,1.5", "# 101,1.5", "line 4: a comment after the header"),
    ],
)
def test_error_names_line_of_wrong_row(tmp_path, old, new, said):
    assert GOOD.count(old) == 1 or old in ("102,", "101,1.5")
    assert said in refused(tmp_path, GOOD.replace(old, new, 1))


@pytest.mark.parametrize(
    ("comment", "said"),
    [
        ("# measured on Monday", "line 1"),
        ("# unit = ADSS", "line 1"),
        ("# [section]", "line 1"),
        ('# unit = "EDSS"', "'unit' is given twice"),
        ("# sweep = 'sideways'", "sweep 'sideways'"),
        ("# sweep = ['up']", "sweep ['up']"),
        ("# settle_cycles = 1.5", "settle_cycles 1.5"),
        ("# settle_cycles = -1", "settle_cycles -1"),
        ("# settle_cycles = true", "settle_cycles True"),
        ("# integrate_cycles = 0", "integrate_cycles 0"),
        ("# from_rest = 'yes'", "from_rest 'yes'"),
        ("# repeated_points = 2", "repeated_points 2 is not true or false"),
        ("# point_flags = [0, 0]", "point_flags must be 3"),
        ("# point_flags = [0, 0, 999]", "point_flags must be 3"),
    ],
)
def test_a_wrong_comment_is_refused(tmp_path, comment, said):
    assert said in refused(tmp_path, comment + "\n" + GOOD)


@pytest.mark.parametrize("sweep", ["# sweep = 'up'\n", ""])
def test_falling_frequencies_need_a_downward_sweep(tmp_path, sweep):
    rows = "102,1,-3,,\n101,1,-3,,\n100,1,-3,,\n"
    text = sweep + '# unit = "ADSS"\n' + HEADER + rows
    assert "out of order" in refused(tmp_path, text)


@given(content=st.binary(max_size=300) | st.text(max_size=300).map(str.encode))
@settings(max_examples=50, deadline=None)
def test_any_bytes_raise_only_file_errors(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "any.csv"
    path.write_bytes(content)
    with pytest.raises(FileFormatError):
        read_response(path)


cells = st.one_of(st.floats().map(repr), st.integers().map(str), st.text(max_size=5))


@given(row=st.lists(cells, min_size=4, max_size=6))
@settings(max_examples=75, deadline=None)
def test_row_is_refused_or_read_as_written(row, tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "row.csv"
    path.write_bytes((GOOD + "200,1.5,-5,12,0.1\n" + ",".join(row) + "\n").encode())
    try:
        read = read_response(path)
    except FileFormatError:
        return
    if len(read) == 5:
        assert read.frequency_hz[4] == float(row[0]) > 0
        assert read.source_vpk[4] == float(row[1]) > 0
        # At another level it is the first row of that.
        assert read.frequency_hz[4] > 200 or read.source_vpk[4] != 1.5
        assert np.isfinite(read.gain[4])


def test_directory_and_missing_file_are_refused(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(FileFormatError, match="is a directory"):
        read_response(tmp_path / "folder.csv")
    with pytest.raises(FileFormatError, match=r"nowhere\.csv.*cannot be read"):
        read_response(tmp_path / "nowhere.csv")
    with pytest.raises(FileFormatError):
        read_response(Path("bad\x00name.csv"))


@pytest.mark.parametrize("name", ["response.xlsx", "response", ".csv", "csv"])
def test_an_unknown_suffix_lists_the_known_ones(name, tmp_path):
    for verb in (read_response, check_writable, lambda path: write_response(response(), path)):
        with pytest.raises(InputError, match=r"\.csv"):
            verb(tmp_path / name)
    with pytest.raises(InputError, match="cannot write"):
        check_writable("trace.sdf")


def test_failed_write_keeps_the_old_file_only(tmp_path):
    path = tmp_path / "kept.csv"
    write_response(response(), path)
    before = path.read_bytes()
    hopeless = [
        response(gain=[0.5, 0.0, 0.1]),
        response(gain=[0.5, math.nan, 0.1]),
        response(frequency_hz=[100.0, 102.0, 101.0]),
        response(source_vpk=0.0),
        response(provenance={"kind": object()}),
        response(provenance={"note": "\ud800"}),
        response(flags=PointFlag.SPOILT),
    ]
    for bad in hopeless:
        with pytest.raises(InputError):
            write_response(bad, path)
        assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["kept.csv"]


def test_folder_device_or_missing_folder_is_refused(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "pipe.csv").symlink_to("/dev/null")
    for place in ("folder.csv", "pipe.csv", "missing/response.csv"):
        with pytest.raises(InputError):
            write_response(response(), tmp_path / place)
    assert Path("/dev/null").is_char_device()


def test_link_is_followed_and_kept(tmp_path):
    (tmp_path / "real.csv").write_text("old")
    (tmp_path / "link.csv").symlink_to("real.csv")
    write_response(response(), tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert len(read_response(tmp_path / "real.csv")) == 3


def test_spoilt_readings_are_listed_apart(tmp_path):
    path = tmp_path / "spoilt.csv"
    flags = [0, PointFlag.SPOILT, 0, PointFlag.OVERLOAD]
    spoilt = response(
        frequency_hz=[100.0, 101.0, 102.0, 103.0], gain=[0.5, math.nan, 0.3, 0.2], flags=flags
    )
    write_response(spoilt, path)
    read = read_response(path)
    assert read.frequency_hz.tolist() == [100.0, 102.0, 103.0]
    assert read.provenance["spoilt_points"] == [[101.0, 1.5]]
    assert read.flags.tolist() == [0, 0, PointFlag.OVERLOAD]
    write_response(read, path)
    assert_same(read_response(path), read)


def test_invalid_offset_is_refused_with_its_file(tmp_path):
    path = tmp_path / "odd.csv"
    path.write_text('# dc_offset_v = "half"\n' + PRACTICE[0].read_text())
    with pytest.raises(FileFormatError, match=r"odd\.csv: .*dc_offset_v 'half' is no voltage"):
        read_response(path)
