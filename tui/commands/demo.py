"""``lashbench demo``: the whole job without hardware, with something hidden to be found.

Owns the order of the steps and what a newcomer is told about each. Every step
is the one that the other verbs take.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from daq.errors import InputError
from tui.exit_codes import INTERRUPTED
from tui.options import Json, Tolerance, Whole, prepare_directory, tolerance_shares
from tui.places import cache_folder
from tui.text.output import Console, Injected
from tui.text.shell_quote import pasted

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse
    from daq.session_events import Finished
    from sim.unit import Unit
    from tui.demonstration.hidden import Hidden

__all__ = ["demo"]

_TOLD = 5
"""Lines that a long job prints where nobody watches a terminal."""


def demo(
    *,
    surprise: bool = False,
    seed: Annotated[Whole | None, Parameter(help="Hide the same surprise again.")] = None,
    out: Path = Path("demo"),
    tolerance: Tolerance = None,
    json: Json = False,
    console: Injected,
) -> int:
    """Measure a simulated bench, tell the backlash, and find what is hidden in its unit.

    A simulated analyser is served on a socket of this computer, with a unit
    behind it that differs from its datasheet. The real driver measures it.

    Parameters
    ----------
    surprise
        Hide something drawn at random from the catalogue, and let you guess.
    out
        Directory for history, response, figures and report, made if it is not there.
    """
    from sim.unit import load_unit
    from tui.demonstration.hidden import drawn, standing

    if seed is not None and (seed < 0 or not surprise):
        raise InputError(f"--seed {seed}: give 0 or more, and --surprise with it")
    began = time.perf_counter()
    prepare_directory(out)
    unit = load_unit("adss").with_tolerance(tolerance_shares(tolerance))
    hidden = drawn(unit, seed) if surprise else standing()
    tell = console.note if json else console.data
    tell("1. A simulated analyser, and a sweep on it (SIMULATED: ADSS)\n")
    finished = _measure(unit, hidden, out / "bench.db", tell, console)
    if finished.state != "complete":
        console.note(f"{finished.state}: {finished.reason}")
        return INTERRUPTED
    response = _features(out, finished.measurement, tell)
    guess = ask_guess(console) if surprise else None
    document = _judge(response, unit, hidden, out, finished.measurement, guess, tell, console)
    document |= {"seed": hidden.seed, "elapsed_s": time.perf_counter() - began}
    if json:
        console.document(document)
    tell(f"\nThe report is {(out / 'report.html').resolve()}")
    tell(f"History, response and figures are in {out}/.")
    if surprise:
        again = ["lashbench", "demo", "--surprise", "--seed", str(hidden.seed), "--out", str(out)]
        tell(f"The same once more: {pasted(again)}")
    console.note(f"done in {document['elapsed_s']:.0f} s")
    return 0


def _measure(
    unit: Unit, hidden: Hidden, history: Path, tell: Callable[[str], None], console: Console
) -> Finished:
    from tui.demonstration.served import served
    from tui.demonstration.sweep import sweep

    with served(unit, hidden.ratio, hidden.effect, hidden.seed) as address:
        console.note(f"  --instrument {address}")
        finished, picture = sweep(address, unit, history, console)
    tell("\n".join(picture.lines()))
    tell(
        f"measurement {finished.measurement}: {finished.points} points, {finished.flagged} "
        f"flagged; source {finished.source_state.value}"
    )
    return finished


def _features(out: Path, measurement: int, tell: Callable[[str], None]) -> FrequencyResponse:
    from analysis.resonance import extract, summary
    from analysis.response_figure import save_response_figure
    from daq.formats import write_response
    from daq.store import Store

    with Store(out / "bench.db", read_only=True) as store:
        response = store.response(measurement)
    write_response(response, out / "measured.csv")
    features = extract(response)
    tell("\n2. Its anti-resonance (ARF) and resonance (RF)\n")
    tell("\n".join(summary(features)))
    save_response_figure(response, features, out / "measured.png")
    return response


def ask_guess(console: Console) -> str | None:
    """What the person takes it for; None if there is nobody, or nobody who would."""
    from sim.catalogue import CATALOGUE, COMMON

    names = list(COMMON)
    lines = [f"  {at:2}  {name:<24} {CATALOGUE[name].meaning}" for at, name in enumerate(names, 1)]
    question = "Which is it? Number or name, or Enter to pass: "
    answer = console.ask("\n".join(["", "One of these is hidden:", *lines, question]))
    while answer:
        if answer.isdecimal() and 1 <= int(answer) <= len(names):
            return names[int(answer) - 1]
        if answer in names:
            return answer
        answer = console.ask(f"{answer} is none of them; number or name, or Enter to pass: ")
    return None


def _judge(
    response: FrequencyResponse,
    unit: Unit,
    hidden: Hidden,
    out: Path,
    measurement: int,
    guess: str | None,
    tell: Callable[[str], None],
    console: Console,
) -> dict[str, Any]:
    """Estimate, diagnose, reveal and report."""
    from analysis.advice import advise
    from analysis.answer import accept_model
    from tui.demonstration.hidden import compare, worded
    from tui.measurements.reports import report_measurement

    cache = cache_folder()
    tell("\n3. Its backlash by stage, as the plain model has it\n")
    progress = _progress("estimating", console)
    estimate = console.compute.estimate_response(response, unit, progress=progress, cache=cache)
    tell("\n".join(estimate.summary()))
    tell("\n4. What the model lacks\n")
    progress = _progress("diagnosing", console)
    diagnosis = console.compute.diagnose_response(response, unit, cache=cache, progress=progress)
    tell("\n".join(diagnosis.summary()))
    document = diagnosis.to_json()
    advice = advise(accept_model(estimate.to_json(), document), unit)
    tell("\n".join(f"  {text}" for text in advice.lines()))
    outcome = compare(hidden, document)
    tell("\n5. What was hidden\n")
    tell("\n".join(worded(hidden, outcome, document, guess)))
    numbers: Mapping[str, Any] = estimate.to_json()
    report_measurement(
        out / "report.html", out / "bench.db", measurement, unit,
        estimate=numbers, diagnosis=diagnosis,
    )  # fmt: skip
    return {
        "hidden": {
            "effect": hidden.effect.id,
            "parameters": dict(hidden.effect.values),
            "contribution_ratio": hidden.ratio,
        },
        "outcome": outcome,
        "guess": guess,
        "estimate": numbers,
        "diagnosis": document,
        "measurement": measurement,
        "history": str(out / "bench.db"),
        "report": str(out / "report.html"),
    }


def _progress(job: str, console: Console) -> Callable[[float, str], None]:
    """Progress in place on a terminal, else a line now and then."""
    told = [0]

    def show(share: float, text: str = "") -> None:
        if console.watched:
            console.progress(share, text)
        elif int(share * _TOLD) > told[0]:
            told[0] = int(share * _TOLD)
            console.note(f"  {job}: {100 * share:.0f} %")

    return show
