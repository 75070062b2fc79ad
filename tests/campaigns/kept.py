"""Outcomes of a campaign, kept one by one, so that one that was interrupted goes on.

Owns the file, a line of JSON for each outcome, and the seed that a campaign draws.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

__all__ = ["Kept", "drawn_seed"]


class Kept:
    """What is in a file of outcomes, each a dictionary with its seed, and what is added to it."""

    def __init__(self, file: str) -> None:
        self._file = Path(file)
        self._file.parent.mkdir(parents=True, exist_ok=True)
        lines = self._file.read_text().splitlines() if self._file.exists() else []
        self.outcomes: list[dict] = [json.loads(line) for line in lines]

    def add(self, outcome: dict) -> None:
        """Keep one more."""
        self.outcomes.append(outcome)
        with self._file.open("a") as stream:
            stream.write(json.dumps(outcome) + "\n")

    def has(self, seed: int, number: int) -> bool:
        """Whether the outcome of that number is there."""
        return any((one["seed"], one["number"]) == (seed, number) for one in self.outcomes)

    @property
    def seeds(self) -> str:
        """All of them, for a page."""
        return ", ".join(map(str, sorted({one["seed"] for one in self.outcomes})))


def drawn_seed(seed: int | None) -> int:
    """The seed that was given, or one of chance."""
    return int(np.random.SeedSequence().entropy % 2**32) if seed is None else seed
