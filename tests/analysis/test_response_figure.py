"""The Bode figure: what it says of levels, features, provenance and readings left out."""

import numpy as np

from analysis.resonance import Feature, LevelFeatures
from analysis.response_figure import draw_response, save_response_figure
from daq.frf import FrequencyResponse, PointFlag

FREQUENCY = np.arange(100.0, 106.0)


def response(**changes):
    fields = {
        "frequency_hz": np.tile(FREQUENCY, 2),
        "source_vpk": np.repeat([1.5, 2.5], 6),
        "gain": np.linspace(0.1, 1.0, 12) * np.exp(1j),
        "unit": "ADSS",
    }
    return FrequencyResponse.from_arrays(**(fields | changes))


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_each_level_is_named_with_its_features():
    arf = Feature(101.04, 0.26, -20.0, 0.1, 0.01, 0.001, "parabola")
    features = (LevelFeatures(2.5, arf, None, None, None, ("rf: none",)),)
    figure = draw_response(response(), features)
    assert legend(figure) == ["1.5 V", "2.5 V: ARF 101.0 ± 0.3 Hz, no RF"]
    (band,) = figure.axes[0].patches
    low, high = band.get_x(), band.get_x() + band.get_width()
    np.testing.assert_allclose([low, high], [100.78, 101.30])


def test_simulated_data_are_labelled():
    assert draw_response(response()).axes[0].get_title() == "ADSS"
    simulated = response(provenance={"kind": "simulated"})
    assert draw_response(simulated).axes[0].get_title() == "ADSS, SIMULATED"


def test_spoilt_reading_breaks_line_and_is_hollow():
    flags = np.zeros(12, dtype=int)
    flags[2] = PointFlag.SPOILT
    gain = draw_response(response(flags=flags).at_level(1.5)).axes[0]
    drawn = {tuple(line.get_xdata()): line for line in gain.get_lines() if len(line.get_xdata())}
    line = next(line for x, line in drawn.items() if len(x) == 6)
    np.testing.assert_array_equal(np.isnan(line.get_ydata()), FREQUENCY == 102.0)
    assert drawn[(102.0,)].get_markerfacecolor() == "none"


def test_figure_is_written_as_picture(tmp_path):
    save_response_figure(response(), (), tmp_path / "bode.png")
    assert (tmp_path / "bode.png").read_bytes().startswith(b"\x89PNG")
