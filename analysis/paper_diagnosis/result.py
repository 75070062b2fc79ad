"""What a diagnosis from the paper's numbers found.

Owns the record and its warnings. It computes nothing, and has no words and no pictures:
`document`, `text` and `figure` take what is here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from analysis.diagnosis.experiment_design import NextMeasurement
from analysis.paper_diagnosis.evidence import Agreement
from analysis.paper_diagnosis.features import Reading
from analysis.paper_diagnosis.posterior import Belief


@dataclass(frozen=True, eq=False)
class PaperFindings:
    """What the plain model gets wrong about five measured numbers, and what may explain it.

    Parameters
    ----------
    free
        What is believed with the contribution ratio unknown: the verdict.
    known
        The same with ratio and total backlash as measured; None where they were not.
    procedures
        The plain model under other ways of sweeping.
    """

    unit: str
    reading: Reading
    free: Belief
    known: Belief | None
    procedures: dict[str, Agreement]
    next_measurement: NextMeasurement | None
    elapsed_s: float
    believed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """The word for the ratio unknown."""
        return self.free.word

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known about the answer."""
        found = [
            "four or five numbers of one run at one drive level: many sets tie, and what they "
            "cannot tell apart is told by probability only"
        ]
        if not np.isfinite(self.reading.values[[1, 3]]).all():
            found.append("a gain is not known: faults of the measuring chain hide there")
        return tuple(found)

    @property
    def beliefs(self) -> dict[str, Belief]:
        """Both states of knowledge by name."""
        known = {} if self.known is None else {"ratio-as-measured": self.known}
        return {"ratio-free": self.free, **known}
