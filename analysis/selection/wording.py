"""A verdict in words that follow its probability and what the model leaves unexplained.

Owns these words for the command line, the report and the screen, from the document of
``diagnose --json``. It decides nothing and imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = [
    "hidden_words",
    "how_sure",
    "likelihood_words",
    "nothing_hidden",
    "open_questions",
    "verdict_words",
]

_SCALE = (
    (0.99, "virtually certain"),
    (0.95, "extremely likely"),
    (0.90, "very likely"),
    (0.66, "likely"),
    (0.50, "more likely than not"),
    (0.33, "about as likely as not"),
    (0.10, "unlikely"),
    (0.0, "very unlikely"),
)
"""Least probability of each word: the scale of the IPCC (guidance note on uncertainties, 2010)."""

_TOLD = 0.05
"""Least probability from which on another set is told to be open where nothing is missing."""

_CLEAR = 3.0
"""Residual in standard deviations from which on a band is told to be open."""

_SENTENCES = {
    "explained": "{causes} explains the response; the model of the unit alone does not.",
    "ambiguous": "{causes} may explain the response, and others are not ruled out.",
    "unexplained": "Something is missing from the model that no known cause explains: no backlash "
    "and no advice can be told.",
}


def likelihood_words(probability: float) -> str:
    """A probability in words."""
    return next(words for least, words in _SCALE if probability >= least)


def nothing_hidden(document: Mapping[str, Any]) -> str:
    """How likely it is that nothing is hidden, as a number and in words."""
    probability = _of_nothing(document)
    if probability is None:
        return "The probability that nothing is hidden is not known."
    return hidden_words(probability)


def hidden_words(probability: float) -> str:
    """The probability that nothing is hidden, as a number and in words."""
    return (
        f"Among the sets judged, that nothing is hidden has probability {probability:.2f}: "
        f"{likelihood_words(probability)}."
    )


def verdict_words(document: Mapping[str, Any]) -> list[str]:
    """The verdict in sentences: what it says, how likely nothing is hidden, what remains open."""
    word = document["verdict"]
    causes = " with ".join(cause["effect"] for cause in document.get("causes") or ())
    if word == "consistent":
        lines = ["Nothing beyond tolerance is needed to explain this response."]
    else:
        lines = [_SENTENCES[word].format(causes=causes)] if word in _SENTENCES else []
    return lines + how_sure(document)


def how_sure(document: Mapping[str, Any]) -> list[str]:
    """How likely it is that nothing is hidden, and what remains open where nothing is missing."""
    lines = [nothing_hidden(document)]
    left = open_questions(document) if document["verdict"] == "consistent" else []
    return lines + [f"Still open: {'; '.join(left)}." for _ in left[:1]]


def open_questions(document: Mapping[str, Any]) -> list[str]:
    """What a response leaves open that the plain model explains: likely causes and departures."""
    others = [
        f"{' with '.join(one['causes'])} (probability {one['probability']:.2f})"
        for one in document.get("rivals") or ()
        if one["causes"] and not one.get("remark") and one["probability"] >= _TOLD
    ]
    left = [f"{' or '.join(others)} is not ruled out"] if others else []
    clear = [abs(band["sigma"]) for band in document.get("residual") or ()]
    clear = [sigma for sigma in clear if sigma >= _CLEAR]
    if clear:
        bands = "1 band departs" if len(clear) == 1 else f"{len(clear)} bands depart"
        left.append(f"{bands} from the plain model, by up to {max(clear):.1f} sigma")
    return left


def _of_nothing(document: Mapping[str, Any]) -> float | None:
    """The probability of the plain model, and of all within its tolerance, of the sets judged."""
    believed: Sequence[float] = [
        one["probability"]
        for one in document.get("rivals") or ()
        if not one["causes"] or one.get("within_tolerance")
    ]
    if believed:
        return float(sum(believed))
    sides = document.get("site_probability") or {}
    return None if sides.get("none") is None else float(sides["none"])
