"""The picture of several responses: colours, legend, bands, phase and models."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.estimate.datasheet_band import DatasheetBand, LevelBand
from analysis.plots import Curve, draw_overlay
from analysis.plots.traces import level_traces, on_one_branch
from daq.errors import InputError
from daq.frf import FrequencyResponse, PointFlag

FREQUENCY = np.linspace(100.0, 180.0, 9)


def response(levels=(1.5, 2.5), *, phase_deg=0.0, frequency=FREQUENCY, **changes):
    count = len(frequency)
    phase = np.tile(np.broadcast_to(phase_deg, count), len(levels))
    fields = {
        "frequency_hz": np.tile(frequency, len(levels)),
        "source_vpk": np.repeat(levels, count),
        "gain": 0.5 * np.exp(1j * np.radians(phase)),
        "unit": "ADSS",
    }
    return FrequencyResponse.from_arrays(**(fields | changes))


def legend(figure):
    return [text.get_text().strip("\N{ZERO WIDTH SPACE}") for text in figure.legends[0].get_texts()]


def long_lines(axes):
    return [line for line in axes.get_lines() if len(line.get_xdata()) > 1]


def test_one_response_has_a_colour_per_level():
    figure = draw_overlay([Curve("a.csv", response())])
    assert legend(figure) == ["1.5 V peak", "2.5 V peak"]
    assert len({line.get_color() for line in long_lines(figure.axes[0])}) == 2


def test_responses_have_colours_and_levels_have_markers():
    figure = draw_overlay([Curve("a.csv", response()), Curve("b.csv", response((2.5,)))])
    assert legend(figure) == ["a.csv", "b.csv", "1.5 V peak", "2.5 V peak"]
    one, two, three = long_lines(figure.axes[0])
    assert one.get_color() == two.get_color() != three.get_color()
    assert two.get_marker() == three.get_marker() != one.get_marker()


@pytest.mark.parametrize("count", [2, 28])
def test_responses_differ_visibly_and_legend_fits(count):
    names = [f"{number:02}-{'long ' * 30}" for number in range(count)]
    figure = draw_overlay([Curve(name, response((1.0,))) for name in names])
    looks = {(line.get_color(), line.get_linestyle(), line._dash_pattern[1] is not None
              and tuple(line._dash_pattern[1])) for line in long_lines(figure.axes[0])}  # fmt: skip
    assert len(looks) == count
    figure.canvas.draw()
    box, page = figure.legends[0].get_window_extent(), figure.bbox
    assert page.x0 <= box.x0 <= box.x1 <= page.x1
    assert page.y0 <= box.y0 <= box.y1 <= page.y1
    assert figure.axes[0].get_window_extent().height > 2 * 100


def test_too_many_responses_are_refused():
    with pytest.raises(InputError, match="29 responses"):
        draw_overlay([Curve("a", response((1.0,)))] * 29)


def test_phase_is_continuous_and_levels_share_branch():
    true = np.linspace(-100.0, -420.0, 9)
    figure = draw_overlay(
        [Curve("a", response(phase_deg=true)), Curve("b", response(phase_deg=true + 5.0))]
    )
    drawn = [line.get_ydata() for line in long_lines(figure.axes[1])]
    for phase in drawn:
        assert np.abs(np.diff(phase)).max() < 180.0
    np.testing.assert_allclose(drawn[0], true, atol=1e-9)
    np.testing.assert_allclose(drawn[2], true + 5.0, atol=1e-9)


def test_phase_noise_near_half_turn_shifts_nothing():
    steady = np.full(9, -170.0)
    noisy = np.array([-170.0, -171.0, -172.0, -340.0, -355.0, -530.0, -531.0, -530.0, -532.0])
    figure = draw_overlay(
        [
            Curve("a", response((1.0,), phase_deg=steady)),
            Curve("b", response((1.0,), phase_deg=noisy)),
        ]
    )
    _, drawn = (line.get_ydata() for line in long_lines(figure.axes[1]))
    assert np.abs(drawn[-4:] + 171.0).max() < 5.0
    assert np.abs(np.diff(drawn)).max() <= 225.0


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(-179.0, 179.0), min_size=8, max_size=8),
    st.floats(-720.0, 720.0),
    st.sets(st.integers(1, 7), max_size=3),
)
def test_any_phase_is_drawn_to_whole_turns(steps, start, spoilt):
    """Whatever is read and spoilt, a drawn phase is the reading but for whole turns."""
    true = np.cumsum([start, *steps])
    flags = np.zeros(9, dtype=int)
    flags[list(spoilt)] = PointFlag.SPOILT
    parts = (response((1.0,), phase_deg=-90.0), response((1.0,), phase_deg=true, flags=flags))
    _, trace = on_one_branch([one for part in parts for one in level_traces(part)])
    drawn, good = trace.phase_deg, flags == 0
    assert np.isnan(drawn[~good]).all()
    turns = (drawn[good] - true[good]) / 360.0
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)
    assert np.abs(np.diff(drawn[good])).max() <= 225.0 + 1e-6


def test_bands_are_only_stated_errors():
    (band,) = draw_overlay([Curve("a", response((1.0,), gain_std_db=0.5))]).axes[0].collections
    edges = band.get_paths()[0].vertices[:, 1]
    np.testing.assert_allclose([edges.min(), edges.max()], 20 * np.log10(0.5) + [-0.5, 0.5])
    bare = draw_overlay([Curve("a", response())])
    assert not [one for axes in bare.axes for one in axes.collections]


def test_model_is_dashed_on_branch_of_measurement():
    measured = response((1.0,), phase_deg=np.linspace(-170.0, -200.0, 9))
    model = response((1.0,), phase_deg=np.linspace(-182.0, -190.0, 9))
    figure = draw_overlay([Curve("a", measured, (model,))])
    assert legend(figure) == ["1 V peak", "model"]
    one, two = long_lines(figure.axes[1])
    assert (one.get_linestyle(), two.get_linestyle()) == ("-", "--")
    assert np.abs(one.get_ydata() - two.get_ydata()).max() < 20.0


def test_datasheet_band_is_about_its_median():
    hz, phase = np.linspace(100.0, 140.0, 5), np.linspace(-170.0, -190.0, 5)
    level = LevelBand(2.5, hz, np.array([[-9.0], [-7.0], [-4.0]]) + np.zeros(5),
                      phase + 360.0 + np.array([[-5.0], [0.0], [8.0]]))  # fmt: skip
    seen = FrequencyResponse.from_arrays(hz, 2.5, 0.5 * np.exp(1j * np.radians(phase)), unit="ADSS")
    figure = draw_overlay(
        [Curve("a.csv", seen, band=DatasheetBand((level,), "datasheet", "WORDS"))]
    )
    gain, phases = figure.axes
    for axes, low, high in ((gain, -9.0, -4.0), (phases, -195.0, -162.0)):
        (band,) = axes.collections
        corners = band.get_paths()[0].vertices
        assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((low, high))
    assert "WORDS" in figure.legends[0].get_title().get_text()
    assert legend(figure)[-1] == "model"


def test_spoilt_readings_are_hollow_and_break_line():
    flags = np.zeros(9, dtype=int)
    flags[4] = PointFlag.SPOILT
    figure = draw_overlay([Curve("a", response((1.0,), flags=flags))])
    line, hollow = long_lines(figure.axes[0])
    assert np.flatnonzero(np.isnan(line.get_ydata())).tolist() == [4]
    assert hollow.get_markerfacecolor() == "none"


def test_foreign_names_are_shown_literally():
    curves = [Curve("_$\\frac$\x1b[2J", response()), Curve("b", response(unit="$x$"))]
    figure = draw_overlay(curves)
    figure.canvas.draw()
    assert "\x1b" not in legend(figure)[0]
    assert legend(figure)[0].startswith("_")


def test_unstated_levels_and_phases_are_labelled():
    figure = draw_overlay(
        [Curve("a", response((np.nan,), phase_known=False, provenance={"kind": "simulated"}))]
    )
    assert legend(figure) == ["level not stated"]
    assert "SIMULATED" in figure.axes[0].get_title()
    assert [text.get_text() for text in figure.axes[1].texts] == ["no phase is stated"]


def test_wide_sweeps_have_a_logarithmic_axis():
    assert draw_overlay([Curve("a", response())]).axes[1].get_xscale() == "linear"
    wide = response(frequency=np.geomspace(1.0, 500.0, 9))
    assert draw_overlay([Curve("a", wide)]).axes[1].get_xscale() == "log"
