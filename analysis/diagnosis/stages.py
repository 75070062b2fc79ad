"""What each stage of a diagnosis cost, and what stood first after it.

Owns the record that makes an answer traceable: one line a stage, in the order in which they ran.
It decides nothing and changes no answer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from analysis.selection.verdict import Verdict
from sim.engine.effort import counting

__all__ = ["Record", "Stage"]


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage: `simulated_s` of motion, `processor_s` of this process, and what it led to.

    `word` of the verdict and `best` set after it; None before there is a verdict.
    """

    name: str
    simulated_s: float
    processor_s: float
    word: str | None
    best: tuple[str, ...] | None

    def to_json(self) -> dict[str, Any]:
        """As a diagnosis has it under ``info``."""
        return {
            "stage": self.name,
            "simulated_s": self.simulated_s,
            "processor_s": self.processor_s,
            "verdict": self.word,
            "first": None if self.best is None else list(self.best),
        }


@dataclass(eq=False)
class Record:
    """The stages so far, and the verdict that stands."""

    stages: list[Stage] = field(default_factory=list)
    verdict: Verdict | None = None

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Run a stage; whoever runs it sets `verdict` where the stage has one."""
        began_s = time.process_time()
        with counting() as effort:
            yield
        verdict = self.verdict
        self.stages.append(
            Stage(
                name,
                effort.simulated_s,
                time.process_time() - began_s,
                None if verdict is None else verdict.word,
                None if verdict is None else verdict.best.effects,
            )
        )
