"""``lashbench extract``: ARF, RF and damping of a response.

Owns the options of the verb only. What a feature is, and how sure it is, is
the analysis's.
"""

from __future__ import annotations

from pathlib import Path

from tui.judging import limits_to_judge_by, tell, tell_judged
from tui.options import Json, JudgeBy
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_file
from tui.text.output import Injected

__all__ = ["extract"]


def extract(
    file: Path,
    /,
    *,
    given: ReadingOptions = NO_OPTIONS,
    judge: JudgeBy = None,
    json: Json = False,
    console: Injected,
) -> int:
    """Read anti-resonance, resonance and damping out of a response, per source level.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    """
    limits = limits_to_judge_by(judge)
    response = read_file(file, given, console)
    from analysis.resonance import extract as features_of
    from analysis.resonance import summary, to_json

    features = features_of(response, console.progress)
    if not any(level.arf or level.rf for level in features):
        console.note(
            f"{file}: neither ARF nor RF was found at any level; the flags of each level say why"
        )
    document, lines = to_json(features), summary(features)
    if limits is None:
        tell(document, lines, json, console)
        return 0
    from analysis.acceptance import judge as judged_by
    from analysis.observation.excitation import sine_doubt
    from analysis.observation.incomplete import state_doubt

    doubts = [sine_doubt(response), state_doubt(response.provenance.get("state"))]
    judgement = judged_by(limits, features=document, doubt="; ".join(filter(None, doubts)))
    return tell_judged(judgement, document, lines, json, console)
