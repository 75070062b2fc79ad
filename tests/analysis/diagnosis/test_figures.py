"""What is drawn of a diagnosis: what the plain model leaves, and what stands first."""

import matplotlib.pyplot as plt
import pytest
from outputs import report_makings as makings

from analysis.diagnosis.figures import residual_figure


@pytest.mark.parametrize(
    ("hidden", "judged", "label", "title"),
    [
        (("load-inertia",), ("load-inertia",), "extended", "explained, load-inertia"),
        # What is refused is where a person goes on from.
        (
            ("load-inertia",),
            ("shaft-stiffness",),
            "what comes nearest",
            "unexplained, nothing named; shaft-stiffness comes nearest",
        ),
        ((), ("load-inertia",), None, "consistent, nothing named"),
    ],
)
def test_residual_figure_shows_plain_and_first_model(monkeypatch, hidden, judged, label, title):
    found = makings.diagnosis(monkeypatch, hidden, [judged])
    figure = residual_figure(found)
    panel = figure.axes[0]
    lines = {line.get_label(): line for line in panel.get_lines() if line.get_marker() != "None"}
    assert set(lines) == {"plain model", *([label] if label else [])}
    assert figure.get_suptitle() == f"ADSS: {title}"
    if label:
        level = found.observation.blocks[0]
        left = found.verdict.best.held_out.residual[0, level]
        assert lines[label].get_ydata() == pytest.approx(8.685889638 * left)
    plt.close("all")
