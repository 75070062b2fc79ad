"""``lashbench demo``: the whole job without hardware.

Owns the order of the steps and what a newcomer is told about each. Every step
is the one that the other verbs take.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from tui.options import prepare_directory
from tui.output import Console, Injected

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse

__all__ = ["demo"]


def demo(*, out: Path = Path("demo"), console: Injected) -> None:
    """Do the whole job without hardware: response, features, backlash, figure.

    Parameters
    ----------
    out
        Directory for the figure and the response, made if it is not there.
    """
    began = time.perf_counter()
    prepare_directory(out)
    from analysis.resonance import extract, summary
    from analysis.response_figure import save_response_figure
    from daq.formats import write_response

    response = _response(console)
    write_response(response, out / "response.csv")
    features = extract(response)
    console.data(f"1. Anti-resonance (ARF) and resonance (RF) of {response.unit}\n")
    console.data("\n".join(summary(features)))
    save_response_figure(response, features, out / "response.png")

    console.data(f"\n2. Backlash of {response.unit}, from the response\n")
    _estimate_response(response, console)
    console.data("\n3. Backlash of the paper's ADSS, from its measured ARF and RF\n")
    _estimate_paper(console)
    console.data(f"\nThe response and its figure are in {out}/.")
    console.note(f"done in {time.perf_counter() - began:.0f} s")


def _response(console: Console) -> FrequencyResponse:
    """The response to work on: a sweep that comes with lashbench."""
    from daq.configs import sample_path
    from daq.formats import read_response

    console.note("reading the sample sweep adss-sweep: simulated, true contribution 93.3 %")
    return read_response(sample_path("adss-sweep"))


def _estimate_response(response: FrequencyResponse, console: Console) -> None:
    from analysis.estimate import estimate_response
    from sim.unit import load_unit

    console.note("estimating: simulates the unit at many contribution ratios")
    result = estimate_response(response, load_unit(response.unit), progress=console.progress)
    console.data("\n".join(result.summary()))


def _estimate_paper(console: Console) -> None:
    from analysis.estimate import estimate_features
    from analysis.paper_numbers import load_paper
    from sim.unit import load_unit

    row = load_paper().measured_row("ADSS")
    console.note("estimating once more")
    result = estimate_features(
        row.arf_hz, row.rf_hz, load_unit(row.unit), progress=console.progress
    )
    console.data(
        f"measured ARF {row.arf_hz:g} Hz and RF {row.rf_hz:g} Hz; "
        f"the paper concludes {row.ratio_percent} %"
    )
    console.data("\n".join(result.summary()))
