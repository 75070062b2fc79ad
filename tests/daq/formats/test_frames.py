"""Responses as pandas tables."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from daq.errors import InputError
from daq.frames import COLUMNS
from daq.frf import FrequencyResponse, PointFlag

pytestmark = pytest.mark.skipif(find_spec("pandas") is None, reason="needs pandas")


@pytest.fixture
def response():
    return FrequencyResponse.from_arrays(
        [100.0, 110.0, 100.0],
        [1.5, 1.5, 2.5],
        [1.0, 10.0j, -0.1],
        unit="ADSS",
        phase_known=[True, True, False],
        gain_std_db=[0.1, np.nan, 0.2],
        flags=[0, PointFlag.OVERLOAD, 0],
        direction="up",
        settle_cycles=20,
        provenance={"kind": "measured", "instrument": {"model": "35670A"}, "runs": (1, 2)},
    )


def test_every_row_and_column_is_there(response):
    frame = response.to_frame()
    assert tuple(frame.columns) == COLUMNS
    assert len(frame) == 3
    assert frame["gain_db"].tolist() == pytest.approx([0.0, 20.0, -20.0])
    assert frame["phase_deg"].tolist()[:2] == pytest.approx([0.0, 90.0])
    assert np.isnan(frame["phase_deg"][2])
    assert np.isnan(frame["gain_std_db"][1])
    assert frame["flags"].tolist() == [0, 1, 0]
    assert frame["gain"].dtype == complex
    assert frame.groupby("source_vpk")["gain_db"].max().to_dict() == pytest.approx(
        {1.5: 20.0, 2.5: -20.0}
    )


def test_attributes_go_along_into_copies(response):
    frame = response.to_frame()
    copied = frame[frame["source_vpk"] > 2.0].copy()
    assert copied.attrs["unit"] == "ADSS"
    assert copied.attrs["direction"] == "up"
    assert copied.attrs["integrate_cycles"] is None
    assert copied.attrs["provenance"]["instrument"] == {"model": "35670A"}


def test_writing_to_table_leaves_response_unchanged(response):
    frame = response.to_frame()
    frame.loc[0, "frequency_hz"] = 1.0
    frame.attrs["provenance"]["kind"] = "made up"
    assert response.frequency_hz[0] == 100.0
    assert response.provenance["kind"] == "measured"


def test_a_response_without_rows(response):
    assert response.take([]).to_frame().shape == (0, len(COLUMNS))


def test_missing_pandas_names_package_to_install(response, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r"lashbench\[frames\]"):
        response.to_frame()
