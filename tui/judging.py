"""The option ``--judge`` of the verbs, and what a screen judges by where none was given.

Owns which limits are read, how a judgement is printed and the exit code of the command.
`analysis.acceptance` decides it; nothing here does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tui.text.layout import WIDTH, wrapped
from tui.text.output import Console, readers_may_leave

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from daq.frf import FrequencyResponse
    from sim.unit import Unit

__all__ = [
    "InForce", "LimitsChoice", "features_for", "judgement_lines", "limits_to_judge_by", "tell",
    "tell_judged",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class InForce:
    """Limits, the name or path that ``--judge`` takes for them, and the unit whose own they are.

    `named` is empty for a unit without a file, `unit` for limits of no unit's own.
    """

    limits: LimitSet
    named: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class LimitsChoice:
    """Where the limits of a screen come from: the first of these that names any.

    Parameters
    ----------
    asked
        Name or path that a person gave; empty for none.
    bench
        Bench file, by name or path; a path in it is relative to it.
    unit, unit_name
        The unit with its own limits, and its name or path, empty where it has none.
    """

    asked: str = ""
    bench: str = "default"
    unit: Unit | None = None
    unit_name: str = ""

    def read(self) -> InForce | None:
        """Read files, so that it runs beside a screen; None where nothing is limited.

        Raises
        ------
        ConfigurationError
            If a file is not there or wrong.
        """
        from pathlib import Path

        from analysis.acceptance import limits_of_unit, load_limits
        from daq.configs import config_names, config_path
        from daq.limits import load_bench

        named = self.asked
        if not named and (of_bench := load_bench(self.bench).judge):
            is_unit = of_bench.lower() in config_names("units")
            folder = config_path("benches", self.bench).parent
            named = of_bench if is_unit else str(folder / Path(of_bench))
        if named:
            return InForce(load_limits(named), named)
        unit = self.unit
        if unit is None:
            return None
        is_limited = unit.acceptance or unit.limits.b1_deg or unit.limits.b2_deg
        return InForce(limits_of_unit(unit), self.unit_name, unit.name) if is_limited else None


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
