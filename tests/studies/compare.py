"""Score the answers of one or two versions on the sets of a paired study.

Owns hit rates, calibration, coverage, cost, and McNemar's exact test between two versions on the
same sets. Sets that one version has not answered are left out for both. It diagnoses nothing.

    python tests/studies/compare.py FOLDER ANSWERS [OTHER_ANSWERS]
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

SURE = 0.95
_BINS = (0.0, 0.5, 0.8, 0.95, 1.0 + 1e-9)


def read_lines(file: Path) -> dict[str, dict[str, Any]]:
    """Records of a file of JSON lines by the name of their set."""
    return {one["set"]: one for one in map(json.loads, file.read_text().splitlines())}


def named(answer: Mapping[str, Any]) -> list[str]:
    """Effects of the named set, sorted; none where nothing is named."""
    return sorted(cause["effect"] for cause in answer["causes"])


def is_whole(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether exactly what is hidden is named."""
    return named(answer) == sorted(truth["effects"])


def is_blamed(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether a cause is named with confidence."""
    return answer["verdict"] == "explained"


def hit(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether an answer is as it should be for its kind of set."""
    if truth["kind"] == "withheld":
        return not is_blamed(truth, answer)
    if truth["kind"] == "nothing":
        return not answer["causes"]
    return is_whole(truth, answer)


def probability_of_first(answer: Mapping[str, Any]) -> tuple[list[str], float]:
    """The likeliest set of an answer and its probability."""
    if answer["causes"]:
        return named(answer), float(answer["causes"][0]["probability"])
    best = max(answer["rivals"], key=lambda one: one["probability"])
    return sorted(best["causes"]), float(best["probability"])


def share(hits: int, count: int) -> str:
    """A share with its 95 % Wilson interval."""
    if count == 0:
        return "none"
    interval = binomtest(hits, count).proportion_ci(method="wilson")
    low, high = 100 * interval.low, 100 * interval.high
    return f"{hits} of {count} ({100 * hits / count:.0f} %, {low:.0f} to {high:.0f} %)"


def score(truths: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, str]:
    """Figures of one version, by what they say."""
    both = [(truths[name], answer) for name, answer in answers.items() if name in truths]

    def rate(kind: str, right: Callable[[Any, Any], bool]) -> str:
        some = [(t, a) for t, a in both if t["kind"] == kind]
        return share(sum(right(t, a) for t, a in some), len(some))

    known = [(t, a) for t, a in both if t["kind"] != "withheld"]
    firsts = [(probability_of_first(a), sorted(t["effects"])) for t, a in known]
    sure = [(first, true) for (first, p), true in firsts if p >= SURE]
    right = [(t, a) for t, a in known if is_whole(t, a)]
    ratios = [(t["ratio"], a["contribution_ratio"]["extended"]) for t, a in right]
    ratios = [(true, one) for true, one in ratios if one["value"] is not None]
    off = [abs(one["value"] - true) for true, one in ratios]
    inside = [abs(one["value"] - true) <= 1.96 * one["std"] for true, one in ratios]
    sizes = [
        (value, size["value"], size["std"])
        for t, a in right
        for cause in a["causes"]
        for name, size in cause["parameters"].items()
        for value in [abs(t["effects"][cause["effect"]][name])]
    ]
    held = [abs(value - true) <= 1.96 * std for true, value, std in sizes]
    cost = [a["processor_s"] for _, a in both]
    return {
        "single named, and nothing else": rate("single", is_whole),
        "pair named whole": rate("pair", is_whole),
        "nothing hidden, something named": rate("nothing", lambda t, a: bool(a["causes"])),
        "nothing hidden, blamed with confidence": rate("nothing", is_blamed),
        "withheld, blamed with confidence": rate("withheld", is_blamed),
        "expected calibration error": f"{calibration_error(firsts):.3f}",
        f"right of answers at {SURE:g} or more": share(
            sum(first == true for first, true in sure), len(sure)
        ),
        "ratio, median error": f"{np.median(off):.4f}" if off else "none",
        "ratio, 95 % interval holds": share(sum(inside), len(inside)),
        "sizes, 95 % interval holds": share(sum(held), len(held)),
        "processor time, median and longest": f"{np.median(cost):.1f} s, {max(cost):.1f} s",
    }


def calibration_error(firsts: Sequence[tuple[tuple[list[str], float], list[str]]]) -> float:
    """Expected calibration error of the first set's probability; NaN of no answers."""
    believed = np.array([p for (_, p), _ in firsts])
    right = np.array([first == true for (first, _), true in firsts], dtype=bool)
    return binned_calibration_error(believed, right, _BINS)


def binned_calibration_error(
    believed: NDArray[np.float64], right: NDArray[np.bool_], edges: Sequence[float]
) -> float:
    """Expected calibration error over bins of belief (Naeini et al. 2015); NaN of no answers."""
    if not len(believed):
        return math.nan
    bins = np.searchsorted(np.asarray(edges)[1:-1], believed, side="right")
    apart = [
        abs(right[bins == one].mean() - believed[bins == one].mean()) * np.mean(bins == one)
        for one in np.unique(bins)
    ]
    return float(np.sum(apart))


def mcnemar(truths: Mapping[str, Any], one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Both versions on the same sets, by kind, with McNemar's exact test."""
    lines = ["| kind | both right | first only | second only | neither | p |", "|" + " --- |" * 6]
    for kind in ("single", "pair", "nothing", "withheld"):
        counts = np.zeros((2, 2), dtype=int)
        for name in one.keys() & other.keys() & truths.keys():
            if truths[name]["kind"] == kind:
                counts[int(hit(truths[name], one[name])), int(hit(truths[name], other[name]))] += 1
        first, second = int(counts[1, 0]), int(counts[0, 1])
        p = binomtest(first, first + second).pvalue if first + second else 1.0
        lines.append(f"| {kind} | {counts[1, 1]} | {first} | {second} | {counts[0, 0]} | {p:.2g} |")
    return "\n".join(lines)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", type=Path, nargs="+")
    given = parser.parse_args()
    truths = read_lines(given.folder / "truth.jsonl")
    versions = [read_lines(file) for file in given.answers]
    names = set.intersection(*(set(one) for one in versions))
    versions = [{name: one[name] for name in sorted(names)} for one in versions]
    scores = [score(truths, one) for one in versions]
    print("| figure | " + " | ".join(file.stem for file in given.answers) + " |")
    print("|" + " --- |" * (1 + len(versions)))
    for figure in scores[0]:
        print(f"| {figure} | " + " | ".join(one[figure] for one in scores) + " |")
    if len(versions) == 2:
        print()
        print(mcnemar(truths, *versions))


if __name__ == "__main__":
    main()
