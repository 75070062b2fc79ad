"""``lashbench estimate``: how much of the backlash sits in each stage.

Owns the options of the verb and which of them go together. The estimate and
its uncertainty are the analysis's.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from daq.errors import InputError
from tui.executors import executor_at
from tui.judging import features_for, limits_to_judge_by, tell, tell_judged
from tui.options import Cluster, Json, JudgeBy, Real, Tolerance, UnitName
from tui.places import cache_folder
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_files
from tui.text.output import Injected
from tui.unit_under_test import read_unit

__all__ = ["estimate"]


def estimate(
    file: Path | None = None,
    /,
    *further: Path,
    unit: UnitName,
    arf_hz: Real | None = None,
    rf_hz: Real | None = None,
    total_backlash_unknown: bool = False,
    as_is: bool = False,
    tolerance: Tolerance = None,
    cluster: Cluster = None,
    given: ReadingOptions = NO_OPTIONS,
    judge: JudgeBy = None,
    json: Json = False,
    console: Injected,
) -> int:
    """Estimate the contribution of stage 1 to the total backlash.

    Give either a response, or several of one unit, or the two frequencies read from one.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    further
        Other sweeps of the same unit, estimated from together with the first.
    arf_hz
        Anti-resonance in Hz, in place of a file.
    rf_hz
        Resonance in Hz, in place of a file.
    total_backlash_unknown
        Estimate the total backlash too, instead of taking the unit's.
    as_is
        Take a response as it stands, also if it looks like a mistake.
    """
    limits, doubt = limits_to_judge_by(judge), ""
    if file is None:
        if cluster is not None:
            raise InputError("--cluster is for responses; two frequencies take a moment here")
        if arf_hz is None or rf_hz is None:
            raise InputError(
                "nothing to estimate from; give a response, or both --arf-hz and --rf-hz"
            )
        if given != NO_OPTIONS:
            raise InputError("there is no file that an option could complete; leave it out")
        if total_backlash_unknown:
            raise InputError(
                "--total-backlash-unknown needs a response at several source levels; "
                "two frequencies cannot tell it"
            )
        subject = read_unit(unit, console, tolerance)
        result = console.compute.estimate_features(
            arf_hz, rf_hz, subject, progress=console.progress
        )
        warnings = []
    else:
        if arf_hz is not None or rf_hz is not None:
            raise InputError(f"{file}: give either a response or --arf-hz and --rf-hz, not both")
        subject = read_unit(unit, console, tolerance)
        responses = read_files([file, *further], given, console)
        from analysis.observation.incomplete import state_doubt
        from analysis.observation.input_check import check_inputs
        from analysis.observation.joint import unit_doubts
        from analysis.observation.stated_error import error_notes

        said = check_inputs(responses, subject, as_is)
        warnings = unit_doubts(responses, subject)
        for note in error_notes(responses):
            console.note(note)
        with executor_at(cluster, console.compute) as executor:
            result = console.compute.estimate_response(
                responses[0], subject, total_backlash_unknown, progress=console.progress,
                cache=cache_folder(), executor=executor, further=responses[1:],
            )  # fmt: skip
        if said:
            result = replace(result, warnings=(*said, *result.warnings), refuted=True)
        incomplete = [state_doubt(one.provenance.get("state")) for one in responses]
        doubt = "; ".join(filter(None, dict.fromkeys([*said, *incomplete])))
    document = result.to_json()
    if json:
        for text in warnings:
            console.note(f"warning: {text}")
    from analysis.acceptance import judge as judged_by
    from analysis.advice import advise
    from analysis.answer import accept_model

    judgement = None
    if limits is not None:
        features = None if file is None else features_for(limits, responses)
        judgement = judged_by(limits, features=features, estimate=document, doubt=doubt)
    advice = advise(accept_model(document), subject, judgement=judgement, doubt=doubt)
    told = [*(f"warning: {text}" for text in warnings), *advice.lines()]
    lines = [*result.summary(), *(f"  {text}" for text in told)]
    whole = document | {"warnings": warnings + document["warnings"]}
    if judgement is None:
        tell(whole, lines, json, console)
        return 0
    return tell_judged(judgement, whole, lines, json, console)
