"""Universal files as other programs write them: read rightly, or refused with the cure."""

import math

import numpy as np
import pytest
import pyuff
from foreign_files import GAIN, HERTZ, binary_58, gain_at, interleaved, text_58
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.errors import FileFormatError, InputError
from daq.formats import Reading, read_response
from daq.formats.reading import remarks_of


def written(path, **changes):
    """A function as pyuff writes it."""
    known = {
        "type": 58, "binary": 0, "func_type": 4, "rsp_node": 1, "rsp_dir": 1, "ref_node": 1,
        "ref_dir": 1, "id1": "test", "abscissa_spacing": 1, "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 11, "orddenom_spec_data_type": 13, "z_axis_value": 0.0,
        "x": HERTZ, "data": GAIN,
    }  # fmt: skip
    pyuff.UFF(str(path)).write_sets(known | changes, "add")


@pytest.mark.parametrize("hertz", [None, HERTZ])
@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_function_may_end_without_line_break(tmp_path, hertz, double, order):
    path = tmp_path / "b.uff"
    one = binary_58(hertz=hertz, double=double, order=order)
    assert not one.removesuffix(b"    -1\n").endswith(b"\n")
    path.write_bytes(one + one)
    with pytest.raises(FileFormatError, match="choose by --function"):
        read_response(path)
    response = read_response(path, Reading(function="2"))
    np.testing.assert_allclose(response.frequency_hz, HERTZ, rtol=1e-6)
    np.testing.assert_allclose(response.gain, GAIN, rtol=1e-6)


@pytest.mark.parametrize("stated", [None, 0, 100, 1448])
def test_binary_data_may_resemble_an_end_mark(tmp_path, stated):
    """Their stated length may be wrong as well."""
    path = tmp_path / "b.uff"
    fake = GAIN.copy()
    fake.real[3] = np.frombuffer(b"\n    -1\n", "<f8")[0]
    path.write_bytes(binary_58(fake, stated=stated))
    np.testing.assert_array_equal(read_response(path).gain, fake)


def test_binary_of_another_machine_names_remedy(tmp_path):
    path = tmp_path / "b.uff"
    for old, new in ((b"58b     1     2", b"58b     1     3"), (b"58b     1", b"58b     3")):
        path.write_bytes(binary_58().replace(old, new))
        with pytest.raises(FileFormatError, match="save it as ASCII data set 58"):
            read_response(path)


def test_set_number_need_not_be_aligned(tmp_path):
    path = tmp_path / "b.uff"
    path.write_bytes(binary_58().replace(b"    58b     1     2          11", b"58b 1 2 11"))
    np.testing.assert_allclose(read_response(path).gain, GAIN)


def test_truncated_or_changed_binary_is_refused(tmp_path):
    path = tmp_path / "b.uff"
    content = binary_58()
    line_ends = content.replace(b"\n", b"\r\n")
    for damaged in (content[:-300], content[:-7], content.replace(b"181", b"191"), line_ends):
        assert damaged != content
        path.write_bytes(damaged)
        with pytest.raises(FileFormatError):
            read_response(path)


@pytest.mark.parametrize("hertz", [None, HERTZ])
def test_last_line_may_be_padded_with_zeros(tmp_path, hertz):
    path = tmp_path / "p.uff"
    numbers = interleaved(hertz=hertz)
    fill = -len(numbers) % 6
    assert fill
    form = {"form": 5, "even": hertz is None, "points": 181}
    path.write_text(text_58([*numbers, *[0.0] * fill], **form))
    np.testing.assert_allclose(read_response(path).gain, GAIN, rtol=1e-4)
    for wrong in ([*numbers, *[0.5] * fill], [*numbers, *[0.0] * (fill + 6)], numbers[:-1]):
        path.write_text(text_58(wrong, **form))
        with pytest.raises(FileFormatError, match="should have 181 points"):
            read_response(path)


def test_unseparated_numbers_and_fortran_exponents_are_read(tmp_path):
    path = tmp_path / "f.uff"
    values = np.full(181, -1.23456e-3)
    text = text_58(values, 2, True, ordinate="dB").replace(" -1.23456E-03", "-1.234560D-03")
    path.write_text(text)
    np.testing.assert_allclose(read_response(path).gain_db, -1.23456e-3, rtol=1e-5)
    path.write_text(text.replace("-1.234560D-03-1.234560D-03", "-1.234560D-03-1.23456xD-03", 1))
    with pytest.raises(FileFormatError, match="no number"):
        read_response(path)


@pytest.mark.parametrize(
    ("name", "row"), [("1", 0), ("2:-Z/1:+X", 1), ("2:-z/1:+x", 1), ("Load point", 1), ("a/c", 2)]
)
def test_function_is_chosen_by_number_dof_name(tmp_path, name, row):
    path = tmp_path / "s.uff"
    written(path)
    written(path, data=2 * GAIN, rsp_node=2, rsp_dir=-3, id1="Load point")
    written(path, data=3 * GAIN, rsp_node=3, rsp_ent_name="a", ref_ent_name="c")
    with pytest.raises(FileFormatError) as caught:
        read_response(path)
    for part in ("3 frequency response functions", "1:+X/1:+X", "2:-Z/1:+X 'Load point'", "a/c"):
        assert part in str(caught.value)
    response = read_response(path, Reading(function=name))
    np.testing.assert_allclose(response.gain, (row + 1) * GAIN, rtol=1e-9)
    with pytest.raises(FileFormatError, match="called 'none'"):
        read_response(path, Reading(function="none"))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("Hz", 1), ("NONE", 1), ("kHz", 1e3), ("rad/s", 0.5 / math.pi), ("rpm", 1 / 60)],
)
def test_the_unit_of_the_abscissa_is_read(tmp_path, unit, factor):
    path = tmp_path / "u.uff"
    path.write_text(text_58(interleaved(), 5, True, points=181, abscissa=unit))
    np.testing.assert_allclose(read_response(path).frequency_hz, HERTZ * factor, rtol=1e-9)


def test_an_unknown_abscissa_is_refused(tmp_path):
    path = tmp_path / "u.uff"
    text = text_58(interleaved(), 5, True, points=181, abscissa="order")
    path.write_text(text)
    with pytest.raises(FileFormatError, match="in 'order', which is no known unit"):
        read_response(path)
    path.write_text(
        text_58(interleaved(), 5, True, points=181).replace("        18    0", "        17    0")
    )
    with pytest.raises(FileFormatError, match="not a frequency but time"):
        read_response(path)


@pytest.mark.parametrize(
    ("third", "level"),
    [
        ((1, "V peak", 2.5), 2.5),
        ((1, "Vrms", 1.0), math.sqrt(2.0)),
        ((0, "V p-p", 3.0), 1.5),
        ((19, "rpm", 1500.0), None),
        ((1, "V", 2.5), None),
        ((0, "", 2.5), None),
    ],
)
def test_third_axis_is_level_only_if_stated(tmp_path, third, level):
    path = tmp_path / "z.uff"
    path.write_text(text_58(interleaved(), 5, True, points=181, third=third))
    response = read_response(path)
    if level is None:
        assert np.all(np.isnan(response.source_vpk))
        assert any("third axis" in text for text in remarks_of(response))
    else:
        np.testing.assert_allclose(response.source_vpk, level)
        with pytest.raises(InputError, match="states a source level"):
            read_response(path, Reading(level_vpk=7.0))


def test_real_function_needs_its_meaning_stated(tmp_path):
    path = tmp_path / "r.uff"
    decibels = 20 * np.log10(np.abs(GAIN))
    for values in (decibels, np.abs(GAIN), GAIN.real):
        path.write_text(text_58(values, 2, True))
        with pytest.raises(FileFormatError, match=r"--column gain_db=1.*--column gain_real=1"):
            read_response(path)
    path.write_text(text_58(decibels, 2, True, ordinate="dB"))
    np.testing.assert_allclose(np.abs(read_response(path).gain), np.abs(GAIN), rtol=1e-4)
    path.write_text(text_58(decibels, 2, True))
    told = read_response(path, Reading(columns=(("gain_db", "1"),)))
    np.testing.assert_allclose(np.abs(told.gain), np.abs(GAIN), rtol=1e-4)
    assert not np.any(told.phase_known)
    path.write_text(text_58(GAIN.real, 2, True) + text_58(GAIN.imag, 2, True))
    both = Reading(columns=(("gain_real", "1"), ("gain_imag", "2")))
    np.testing.assert_allclose(read_response(path, both).gain, GAIN, rtol=1e-4, atol=1e-6)


def test_zero_frequency_row_is_omitted_with_note(tmp_path):
    path = tmp_path / "dc.uff"
    hertz = 0.5 * np.arange(221)
    written(path, x=hertz, data=gain_at(hertz))
    response = read_response(path)
    np.testing.assert_allclose(response.frequency_hz, hertz[1:])
    np.testing.assert_allclose(response.gain, gain_at(hertz[1:]), rtol=1e-9)
    assert "the row at 0 Hz of dc.uff left out" in remarks_of(response)


def test_coherence_and_averages_are_error_bars(tmp_path):
    path = tmp_path / "c.uff"
    written(path)
    written(path, data=np.linspace(0.2, 0.99, 181), func_type=6)
    assert any("--averages N" in text for text in remarks_of(read_response(path)))
    assert np.all(np.isnan(read_response(path).gain_std_db))
    response = read_response(path, Reading(averages=50))
    assert response.provenance["gain_std_is"] == "error bar from coherence and 50 averages"
    # What the same averaging of noise really scatters by.
    rng, draws, n, chosen = np.random.default_rng(3), 400, 50, (0, 90, 170)
    for row in chosen:
        coherence = np.linspace(0.2, 0.99, 181)[row]
        x, e = (rng.normal(size=(draws, n, 2)) @ [1, 1j] for _ in range(2))
        y = x + e * math.sqrt(1 / coherence - 1)
        gain = np.sum(y * x.conj(), axis=1) / np.sum(np.abs(x) ** 2, axis=1)
        scatter = np.std(np.log(np.abs(gain))) * 20 / math.log(10)
        assert 0.8 < scatter / response.gain_std_db[row] < 1.25
        turned = np.degrees(np.std(np.angle(gain)))
        assert 0.8 < turned / response.phase_std_deg[row] < 1.25


def test_options_without_a_use_are_refused(tmp_path):
    path = tmp_path / "o.uff"
    written(path)
    for reading in (Reading(averages=10), Reading(profile="bode100")):
        with pytest.raises(InputError, match="leave it out|leave --averages out"):
            read_response(path, reading)


WHOLE = text_58(interleaved(), 5, True, points=181).encode()


@given(st.integers(0, len(WHOLE) - 1), st.integers(0, len(WHOLE)), st.binary(max_size=3))
@settings(max_examples=40, deadline=None)
def test_damage_is_refused_or_changes_content(tmp_path_factory, start, length, put):
    path = tmp_path_factory.mktemp("d") / "d.uff"
    path.write_bytes(WHOLE[:start] + put + WHOLE[start + length :])
    told = "read"
    try:
        assert len(read_response(path)) == 181
    except InputError as error:
        told = str(error)
    assert told == "read" or (str(path) in told and "\n" not in told)
