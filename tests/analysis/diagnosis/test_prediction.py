"""What a diagnosis says that its models predict, against what it says that they leave."""

import json

import numpy as np
import pytest
from outputs import report_makings as makings

from tui.measurements.stored_shapes import fault_of


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, ("load-inertia",), [("load-inertia",)])


def numbers(values):
    return np.array([np.nan if value is None else value for value in values], float)


def test_predictions_leave_the_stated_residuals(explained):
    document = json.loads(json.dumps(explained.to_json(), allow_nan=False))
    told = document["prediction"]
    rows = len(explained.observation)
    assert len(told["frequency_hz"]) == len(told["source_vpk"]) == rows
    for name in ("baseline", "extended"):
        part = told[name]
        left = np.stack([
            (numbers(told[quantity]) - numbers(part[quantity])) / numbers(part[std])
            for quantity, std in (("gain_db", "gain_std_db"), ("phase_deg", "phase_std_deg"))
        ])  # fmt: skip
        judged = explained.verdict.baseline if name == "baseline" else explained.extended
        rms = float(np.sqrt(np.nanmean(left**2)))
        assert rms == pytest.approx(judged.held_out.rms_sigma, rel=0.02)
    size = document["causes"][0]["parameters"]["J_L"]
    assert size["datasheet"] == pytest.approx(2.75e-3)


def test_stored_prediction_of_wrong_shape_is_refused(explained):
    document = json.loads(json.dumps(explained.to_json()))
    assert fault_of("diagnosis", document) == ""
    document["prediction"]["baseline"]["gain_db"].pop()
    assert "prediction" in fault_of("diagnosis", document)
    document["prediction"]["baseline"]["gain_db"].append("x")
    assert "gain_db" in fault_of("diagnosis", document)
