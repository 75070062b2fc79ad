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


SERVED = "sim:?ratio=0.3&seed=1"
"""The simulated bench: its unit has 30 % of its backlash in stage 1."""


def demo(*, out: Path = Path("demo"), console: Injected) -> None:
    """Do the whole job without hardware: measure, features, backlash, figure.

    Parameters
    ----------
    out
        Directory for the history, the responses and figures, made if it is not there.
    """
    began = time.perf_counter()
    prepare_directory(out)
    console.data("1. A sweep on the simulated bench (SIMULATED: ADSS, 30 % in stage 1)\n")
    measured = _measure(out / "bench.db", console)
    console.data("\n2. Its anti-resonance (ARF) and resonance (RF)\n")
    _show_features(measured, out, "measured", console)
    console.data("\n3. Its backlash\n")
    _estimate_response(measured, console)

    sample = _sample(console)
    console.data("\n4. A sweep that another program made (true contribution 93.3 %)\n")
    _show_features(sample, out, "sample", console)
    console.data("")
    _estimate_response(sample, console)
    console.data("\n5. Backlash of the paper's ADSS, from its measured ARF and RF\n")
    _estimate_paper(console)
    console.data(f"\nHistory, responses and figures are in {out}/.")
    console.note(f"done in {time.perf_counter() - began:.0f} s")


def _measure(history: Path, console: Console) -> FrequencyResponse:
    """A session on the simulated analyser, as `measure` runs it."""
    from daq.store import Store
    from tui.commands.measure import measure

    measure(
        unit="adss",
        instrument=SERVED,
        level=[1.5, 2.5],
        start=115.0,
        stop=165.0,
        points=26,
        db=history,
        operator="demo",
        console=console,
    )
    with Store(history, read_only=True) as store:
        return store.response(store.measurements()[-1].id)


def _show_features(response: FrequencyResponse, out: Path, name: str, console: Console) -> None:
    from analysis.resonance import extract, summary
    from analysis.response_figure import save_response_figure
    from daq.formats import write_response

    write_response(response, out / f"{name}.csv")
    features = extract(response)
    console.data("\n".join(summary(features)))
    save_response_figure(response, features, out / f"{name}.png")


def _sample(console: Console) -> FrequencyResponse:
    """A sweep that comes with lashbench."""
    from daq.configs import sample_path
    from daq.formats import read_response

    console.note("reading the sample sweep adss-sweep")
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
