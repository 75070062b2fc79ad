"""Counts of a line: units, yield, retests, and what failed.

Owns the counting and its words. It reads results and changes none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from tui.line.results import Result
from tui.text.layout import wrapped

__all__ = ["tally_lines"]

_MOST = 10
"""Serial numbers, and reasons, that are listed."""


def tally_lines(results: Sequence[Result]) -> list[str]:
    """Units by their last verdict, first-pass and final yield, retests, and what failed."""
    if not results:
        return ["no unit yet"]
    last = {one.serial: one for one in results}
    first = [one for one in results if one.attempt == 1]
    judged_first = [one for one in first if one.verdict != "MEASURED"]
    verdicts = Counter(one.verdict for one in last.values())
    counts = [f"{verdicts[word]} {word}" for word in ("PASS", "FAIL", "UNDECIDED", "MEASURED")
              if verdicts[word]]  # fmt: skip
    lines = [f"{len(last)} units: {', '.join(counts)}; {len(results) - len(first)} retests"]
    judged = [one for one in last.values() if one.verdict != "MEASURED"]
    if judged:
        passed = sum(one.verdict == "PASS" for one in judged_first)
        lines.append(
            f"yield {_share(verdicts['PASS'], len(judged))}, "
            f"at the first attempt {_share(passed, len(judged_first))}"
        )
    for word, reasons in (("FAIL", "failed"), ("UNDECIDED", "undecided")):
        found = [one for one in last.values() if one.verdict == word]
        if not found:
            continue
        named = [one.serial for one in found[:_MOST]]
        more = f" and {len(found) - _MOST} more" if len(found) > _MOST else ""
        lines += wrapped(f"{word}: {', '.join(named)}{more}", indent="  ")
        why = Counter(name for one in found for name in getattr(one, reasons) or one.reasons[:1])
        told = [f"{name} {number}" for name, number in why.most_common(_MOST)]
        if told:
            lines += [f"  {part}" for part in wrapped(f"by: {', '.join(told)}", 78, "  ")]
    return lines


def _share(part: int, whole: int) -> str:
    return f"{part}/{whole} ({100 * part / whole:.0f} %)" if whole else "-"
