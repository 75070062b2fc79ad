"""The option ``--judge`` of the verbs: limits read first, the judgement told last.

Owns how a judgement is printed and the exit code of the command. `analysis.acceptance` decides
it; nothing here does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tui.text.layout import WIDTH, wrapped
from tui.text.output import Console, readers_may_leave

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from daq.frf import FrequencyResponse

__all__ = ["features_for", "judgement_lines", "limits_to_judge_by", "tell", "tell_judged"]


def limits_to_judge_by(named: str | None) -> LimitSet | None:
    """The limits of ``--judge``; None where it was not given.

    Raises
    ------
    ConfigurationError
        If the file is not there or wrong.
    """
    if named is None:
        return None
    from analysis.acceptance import load_limits

    return load_limits(named)


def features_for(limits: LimitSet, responses: Sequence[FrequencyResponse]) -> dict[str, Any] | None:
    """The document of ``extract`` with the levels of all responses, where a limit asks for it."""
    if not limits.needs_features:
        return None
    from analysis.resonance import extract, to_json

    return to_json([level for response in responses for level in extract(response)])


def judgement_lines(judgement: Judgement) -> list[str]:
    """The verdict, each limit and the rule, for a terminal of 80 columns."""
    head, *further = judgement.lines()
    lines = wrapped(head)
    for text in further:
        first, *rest = wrapped(text, WIDTH - 2, indent="  ")
        lines += [f"  {first}", *(f"  {part}" for part in rest)]
    return lines


def tell(document: Mapping[str, Any], lines: Sequence[str], json: bool, console: Console) -> None:
    """Print a result: the document for programs, or the lines for people."""
    if json:
        console.document(document)
    else:
        console.data("\n".join(lines))


def tell_judged(
    judgement: Judgement,
    document: Mapping[str, Any],
    lines: Sequence[str],
    json: bool,
    console: Console,
) -> int:
    """Print a result with its judgement.

    Returns
    -------
    int
        The exit code: 0 PASS, 6 FAIL, 7 UNDECIDED.
    """
    # The exit code counts, whether or not all was read.
    with readers_may_leave():
        whole = {**document, "judgement": judgement.to_json()}
        tell(whole, [*lines, *judgement_lines(judgement)], json, console)
    return judgement.exit_code
