"""``lashbench diagnose``: what the simulation gets wrong, and why.

Owns the options of the verb. The diagnosis is the analysis's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import InputError
from tui.executors import executor_at
from tui.judging import features_for, limits_to_judge_by, tell, tell_judged
from tui.options import (
    Cluster,
    Json,
    JudgeBy,
    Plots,
    Tolerance,
    UnitName,
    directory_to_fill,
)
from tui.places import cache_folder
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_files
from tui.text.output import Console, Injected, readers_may_leave
from tui.text.shell_quote import proposing
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from analysis.acceptance import LimitSet
    from analysis.diagnosis import Diagnosis
    from analysis.execution.executor import Executor
    from analysis.paper_diagnosis import PaperDiagnosis
    from daq.frf import FrequencyResponse
    from sim.unit import Unit

__all__ = ["diagnose"]


def diagnose(
    file: Path | None = None,
    /,
    *further: Path,
    unit: UnitName,
    paper: bool = False,
    plots: Plots = None,
    json: Json = False,
    as_is: bool = False,
    tolerance: Tolerance = None,
    cluster: Cluster = None,
    given: ReadingOptions = NO_OPTIONS,
    judge: JudgeBy = None,
    console: Injected,
) -> int:
    """Show what the simulation gets wrong, name the cause and extend the model with it.

    Asks the posterior of the unit, which was trained over every cause of the catalogue, which
    causes the response looks like, and simulates those through the sweep that was measured.
    That nothing is missing, and that nothing known explains it, are answers too.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    further
        Other sweeps of the same unit, diagnosed together with the first.
    paper
        Diagnose the paper's own measured frequencies and gains in place of a file.
    as_is
        Take a response as it stands, also if it looks like a mistake.
    """
    if paper == (file is not None):
        raise InputError("nothing to diagnose; give either a response or --paper" if not paper
                         else f"{file}: give either a response or --paper, not both")  # fmt: skip

    if paper and given != NO_OPTIONS:
        raise InputError("--paper reads no file that an option could complete; leave it out")
    if paper and cluster is not None:
        raise InputError("--cluster is for responses; the paper's numbers are diagnosed here")
    if paper and judge is not None:
        raise InputError("--paper is about no unit of a bench; leave out --judge")
    limits = limits_to_judge_by(judge)
    subject = read_unit(unit, console, tolerance)
    with directory_to_fill(plots):
        if file is None:
            _diagnose_paper(subject, unit, plots, json, console)
            return 0
        return _diagnose_files(
            [file, *further], subject, unit, plots, json, as_is, cluster, given, limits, console
        )


def _diagnose_files(
    files: Sequence[Path],
    subject: Unit,
    unit: str,
    plots: Path | None,
    json: bool,
    as_is: bool,
    cluster: str | None,
    given: ReadingOptions,
    limits: LimitSet | None,
    console: Console,
) -> int:
    response, *others = read_files(files, given, console)
    from analysis.observation.excitation import refuse_signal
    from analysis.observation.incomplete import state_doubt
    from analysis.observation.input_check import check_inputs
    from analysis.observation.joint import check_together, unit_doubts
    from analysis.observation.stated_error import error_doubts, error_notes

    check_together((response, *others))
    refuse_signal((response, *others))
    said = check_inputs((response, *others), subject, as_is)
    for note in error_notes((response, *others)):
        console.note(note)
    doubts = unit_doubts((response, *others), subject) + error_doubts((response, *others))
    for doubt in doubts:
        # Now, as well as with the answer: it may be a slip, and the answer takes a minute.
        console.note(f"warning: {doubt}")
    with executor_at(cluster, console.compute) as executor:
        said += _settings((response, *others), subject, as_is, executor, console)
        incomplete = [state_doubt(one.provenance.get("state")) for one in (response, *others)]
        doubt = "; ".join(filter(None, dict.fromkeys([*said, *incomplete])))
        result = console.compute.diagnose_response(
            response, subject, further=others, cache=cache_folder(), executor=executor,
            progress=console.progress,
        )  # fmt: skip
    if said:
        result = replace(result, warnings=(*said, *result.warnings))
    result = proposing(result, unit, (response, *others))
    code, document, judgement = 0, result.to_json(), None
    from analysis.acceptance import judge as judged_by
    from analysis.advice import advise
    from analysis.answer import accept_model

    if limits is not None:
        features = features_for(limits, (response, *others))
        judgement = judged_by(limits, features=features, diagnosis=document, doubt=doubt)
    advice = advise(accept_model(None, document), subject, judgement=judgement, doubt=doubt)
    if judgement is None:
        _tell(result, json, console, advice.lines())
    else:
        lines = [*result.summary(), *(f"  {text}" for text in advice.lines())]
        code = tell_judged(judgement, document, lines, json, console)
    if plots is not None:
        for path in console.compute.draw_diagnosis(result, plots):
            console.note(f"wrote {path}")
    return code


def _settings(
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    as_is: bool,
    executor: Executor | None,
    console: Console,
) -> list[str]:
    """Refuse what is likely swept otherwise than stated, or say it where a cause does as much."""
    from analysis.estimate import free_axes
    from analysis.estimate.settings import search_doubt

    if unit.stages == 1:
        return []
    doubt = search_doubt(
        responses, unit, free_axes(unit), cache=cache_folder(), executor=executor,
        progress=console.progress,
    )  # fmt: skip
    if doubt is None:
        return []
    if not doubt.rival and not as_is:
        raise InputError(f"{doubt.words}; or take it as it stands with --as-is")
    console.note(f"warning: {doubt.warning}")
    return [doubt.warning]


def _diagnose_paper(
    subject: Unit, unit: str, plots: Path | None, json: bool, console: Console
) -> None:
    result = console.compute.diagnose_paper(subject, progress=console.progress)
    _tell(proposing(result, unit), json, console)
    if plots is not None:
        for path in result.plot(plots):
            console.note(f"wrote {path}")


def _tell(
    result: Diagnosis | PaperDiagnosis, json: bool, console: Console, advice: Sequence[str] = ()
) -> None:
    """The answer itself, before any picture of it: that may fail, and must not cost it."""
    # Who reads no more of it may still want the pictures.
    with readers_may_leave():
        lines = [*result.summary(), *(f"  {text}" for text in advice)]
        tell(result.to_json(), lines, json, console)
