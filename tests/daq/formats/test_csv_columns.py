"""What a CSV keeps of a response beside its five columns."""

import numpy as np
import pytest
from worlds.responses import ARRAYS, REST, measured

from daq.errors import FileFormatError
from daq.formats import read_response, write_response


def test_every_column_is_read_back(tmp_path):
    response = measured()
    write_response(response, tmp_path / "x.csv")
    read = read_response(tmp_path / "x.csv")
    for name in set(ARRAYS) - {"gain"}:
        np.testing.assert_array_equal(getattr(read, name), getattr(response, name), err_msg=name)
    # Decibels and degrees cost the last digit of the gain.
    np.testing.assert_allclose(read.gain, response.gain, rtol=5e-15)
    for name in REST:
        assert getattr(read, name) == getattr(response, name)
    assert dict(read.provenance) == dict(response.provenance)


def test_partly_known_column_is_kept(tmp_path):
    response = measured(phase_std_deg=np.nan, harmonic3=np.nan, dc_v=np.nan)
    response.dc_v[3] = 0.1 + 0.2
    write_response(response, tmp_path / "x.csv")
    text = (tmp_path / "x.csv").read_text()
    assert "point_dc_v" in text
    assert "point_phase_std_deg" not in text
    assert "point_harmonic" not in text
    np.testing.assert_array_equal(read_response(tmp_path / "x.csv").dc_v, response.dc_v)


@pytest.mark.parametrize(
    "value",
    ["[1.0]", "3", '"x"', "[[1.0, 2.0]]", '["a", "b"]', "[[1.0], [1.0, 2.0]]", "[true]", "{a = 1}"],
)
@pytest.mark.parametrize("key", ["point_dc_v", "point_harmonic2"])
def test_list_of_other_length_is_refused(tmp_path, key, value):
    path = tmp_path / "x.csv"
    write_response(measured(dc_v=np.nan, harmonic3=np.nan), path)
    path.write_text(f"# {key} = {value}\n" + path.read_text())
    with pytest.raises(FileFormatError, match=f"{key} must be 10"):
        read_response(path)
