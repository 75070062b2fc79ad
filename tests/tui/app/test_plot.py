"""Plots in characters: scales, contrast, continuous phase, bands, cursor, zoom and pan."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from outputs.screen import run, text_of
from textual.app import App
from textual.color import Color

from daq.frf import FrequencyResponse
from tui.app.plot.bode import BodePlot
from tui.app.plot.canvas import Canvas
from tui.app.plot.chart import Chart
from tui.app.plot.layers import Band, Curve, Marks
from tui.app.plot.palette import LEAST_CONTRAST, contrast
from tui.app.plot.scales import Scale, degree_scale, frequency_scale, linear_scale
from tui.app.plot.traces import Prediction, continuous_phase, traces_of_response

HERTZ = np.linspace(100.0, 180.0, 41)
GRID = set("\u2508\u250a\u253c \u2581\u2582\u2583\u2584\u2585\u2586\u2587")


def response(std_db=0.5):
    s, low, high = 2j * np.pi * HERTZ, 2 * np.pi * 128.0, 2 * np.pi * 148.0
    gain = (s**2 + 0.04 * low * s + low**2) / (s**2 + 0.04 * high * s + high**2)
    gain = gain * np.exp(-s * 0.01)
    return FrequencyResponse.from_arrays(
        np.tile(HERTZ, 2), np.repeat([1.5, 3.0], 41), np.concatenate([gain, 0.8 * gain]),
        gain_std_db=np.full(82, std_db), unit="ADSS",
    )  # fmt: skip


class Shown(App):
    def __init__(self, theme="textual-dark", predictions=()):
        super().__init__()
        self.wanted, self.predictions = theme, predictions

    def compose(self):
        yield BodePlot()

    def on_mount(self):
        self.theme = self.wanted
        plot = self.query_one(BodePlot)
        plot.focus()
        plot.draw(traces_of_response(response()), None, [(128.0, "ARF")], self.predictions)


def shown(steps, size=(90, 30), **options):
    async def way():
        app = Shown(**options)
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            await steps(app, pilot)

    run(way)


@given(
    st.floats(-1e4, 1e4), st.floats(1e-4, 1e4), st.integers(4, 120),
    st.sampled_from([linear_scale, degree_scale, frequency_scale]),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_scale_covers_range_with_even_ticks(low, span, cells, scale):
    if scale is frequency_scale:
        low = abs(low) + 0.01
    high = low + span
    if not high > low:
        return
    found = scale(low, high, cells)
    places = found.place(np.array([low, high, *found.ticks]))
    assert np.all((places >= -1e-6) & (places <= cells + 1e-6))
    assert len(found.labels) == len(found.ticks) == len(set(found.labels))
    if not found.is_log:
        apart = np.diff(np.floor(places[2:] + 1e-6))
        assert len(set(apart.tolist())) <= 1
        if scale is not frequency_scale:
            assert len(found.ticks) >= 2
    assert found.value(float(found.place(np.array([low]))[0])) == pytest.approx(low, abs=1e-6)


@pytest.mark.parametrize(
    ("band", "cells", "labels"),
    [
        ((10.0, 1000.0), 60, ["10", "20", "50", "100", "200", "500", "1000"]),
        ((100.0, 180.0), 66, [str(n) for n in range(100, 190, 10)]),
        ((100.3, 100.9), 50, [f"100.{n}" for n in range(3, 10)]),
    ],
)
def test_frequency_ticks_are_round(band, cells, labels):
    assert frequency_scale(*band, cells).labels == labels


def test_phase_ticks_are_parts_of_a_turn():
    assert set(np.diff(degree_scale(-190, -20, 12).ticks)) <= {30.0, 45.0, 90.0}


def test_phase_is_continuous_and_levels_share_branch():
    true = np.linspace(-100.0, -800.0, 60)
    wrapped = (true + 180.0) % 360.0 - 180.0
    gap = wrapped.copy()
    gap[20:23] = np.nan
    first, second, empty = continuous_phase([wrapped, gap - 360.0, np.full(4, np.nan)])
    assert np.max(np.abs(np.diff(first))) < 180.0
    np.testing.assert_allclose(np.diff(first), np.diff(true), atol=1e-9)
    np.testing.assert_allclose(second[np.isfinite(gap)], first[np.isfinite(gap)], atol=1e-9)
    assert np.isnan(empty).all()


@pytest.mark.parametrize(
    "theme", ["textual-dark", "textual-light", "nord", "solarized-light", "dracula", "flexoki"]
)
def test_axes_labels_and_curves_can_be_read(theme):
    seen = set()

    async def steps(app, pilot):
        await pilot.press("left")
        for chart in app.query(Chart):
            for row in range(chart.size.height):
                for segment in chart.render_line(row):
                    if set(segment.text) <= GRID | set(
                        "\u2581\u2582\u2583\u2584\u2585\u2586\u2587"
                    ):
                        continue
                    front, back = segment.style.color, segment.style.bgcolor
                    ratio = contrast(Color.from_rich_color(front), Color.from_rich_color(back))
                    is_axis = any(sign in segment.text for sign in "\u2502\u2524\u2500\u252c")
                    tinted = back.name != app.query_one("#gain", Chart).palette.background
                    # Curves and marks over a band are graphics, which need 3:1.
                    assert ratio >= (3.0 if tinted else LEAST_CONTRAST), (segment, ratio)
                    seen.add("axis" if is_axis else "data")

    shown(steps, theme=theme)
    assert seen == {"axis", "data"}


def test_plot_is_complete_without_known_colours():
    async def steps(app, pilot):
        for segment in app.query_one("#gain", Chart).render_line(10):
            front, back = segment.style.color.name, segment.style.bgcolor.name
            # The terminal's own text on its own background can be read.
            assert front != back or front == "default", segment
        assert "dB re 1 V/V" in text_of(app)

    shown(steps, theme="ansi-dark")


def test_crowded_traces_keep_their_marks():
    async def steps(app, pilot):
        rows = text_of(app).splitlines()[1:18]
        for mark in "\u25cf\u25a0":
            # Between too few to tell a trace by, and a mark for every point.
            assert 3 <= sum(row.count(mark) for row in rows) <= 14

    shown(steps, size=(60, 30))


def test_axes_show_units_and_cursor_reads_values():
    async def steps(app, pilot):
        screen = text_of(app)
        for words in (
            "gain, dB re 1 V/V",
            "phase, deg",
            " Hz ",
            "\u25cf 1.5 V",
            "\u25a0 3 V",
            "ARF",
        ):
            assert words in screen, words
        plot = app.query_one(BodePlot)
        assert plot.reading == ""
        await pilot.press("right")
        gain_db = response().at_level(1.5).gain_db[np.argmin(np.abs(HERTZ - plot.cursor_hz))]
        assert f"{plot.cursor_hz:.2f} Hz 1.5 V: {gain_db:.2f} +-0.50 dB" in plot.reading
        assert plot.reading.count("Hz") == 1
        await pilot.click("#gain", offset=(20, 5))
        assert plot.cursor_hz < 120.0

    shown(steps)


def test_keys_zoom_and_pan():
    async def steps(app, pilot):
        plot = app.query_one(BodePlot)
        await pilot.press("right", "up", "up")
        low, high = plot.view_hz
        assert high - low == pytest.approx(20.0)
        assert low < plot.cursor_hz < high
        assert "zoom" in text_of(app)
        await pilot.press("greater_than_sign")
        assert plot.view_hz[0] == pytest.approx(low + 5.0)
        await pilot.press(*["shift+left"] * 4)
        # The cursor takes the band along, to the end of what was measured.
        assert plot.view_hz[0] == pytest.approx(100.0)
        await pilot.press("down", "down", "down")
        assert plot.view_hz is None
        await pilot.press("up", "home")
        assert plot.view_hz is None

    shown(steps)


def test_prediction_has_dashed_line_and_error_bars():
    """The prediction lies in a band, and stated errors are bars."""
    gain = response().at_level(1.5)
    model = Prediction(
        "plain model", HERTZ, gain.gain_db - 6.0, gain.gain_db + [[-8.0], [-4.0]], gain.phase_deg,
        gain.phase_deg + [[-5.0], [5.0]], 0,
    )  # fmt: skip

    async def steps(app, pilot):
        chart = app.query_one("#gain", Chart)
        bands = [one for one in chart.drawing.layers if isinstance(one, Band)]
        (band,) = bands
        np.testing.assert_allclose(band.high - band.low, 4.0)
        assert "band plain model" in text_of(app)

    shown(steps, predictions=(model,))


def test_band_ends_on_eighths_below_the_data():
    x = Scale(0.0, 10.0, 10, ())
    y = Scale(0.0, 4.0, 4, ())
    canvas = Canvas(x, y, "#000000")
    ends = np.array([0.0, 10.0])
    canvas.draw(Band(ends, np.full(2, 1.5), np.full(2, 3.25), "#202020"))
    rows = [canvas.segments(row) for row in range(4)]
    assert ["".join(part.text for part in row) for row in rows] == [
        "\u2582" * 10, " " * 10, "\u2584" * 10, " " * 10,
    ]  # fmt: skip
    assert rows[1][0].style.bgcolor.name == "#202020"
    canvas.draw(Curve(ends, np.array([2.5, 2.5]), "#ff0000"))
    canvas.draw(Marks(np.array([5.0]), np.array([2.5]), ["x"], ["#00ff00"]))
    row = canvas.segments(1)
    assert "x" in "".join(part.text for part in row)
    assert {part.style.bgcolor.name for part in row} == {"#202020"}


@given(
    st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=2, max_size=8),
    st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_no_number_breaks_a_drawing(values, dashed):
    x, y = linear_scale(0.0, 10.0, 20), linear_scale(-1.0, 1.0, 6)
    canvas = Canvas(x, y, "#000000")
    canvas.grid("#111111")
    places, heights = np.linspace(0.0, 10.0, len(values)), np.array(values)
    with np.errstate(all="ignore"):
        canvas.draw(Band(places, heights - 1.0, heights + 1.0, "#202020"))
        canvas.draw(Curve(places, heights, "#ff0000", dashed))
        canvas.draw(Marks(places, heights, ["x"] * len(values), ["#ff0000"] * len(values)))
    for row in range(6):
        assert sum(len(part.text) for part in canvas.segments(row)) == 20
