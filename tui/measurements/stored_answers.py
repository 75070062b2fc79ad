"""Estimates and diagnoses that a history holds: which is taken, and how one is kept.

Owns when a stored answer is that of today: the same points, the same values and
tolerances of the unit, the same edition of the inference. It analyses nothing and prints nothing.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from daq.errors import ConfigurationError, FileFormatError
from daq.servers.place import HistoryPlace
from tui.measurements.measured_unit import unit_as_measured

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse
    from daq.store import Store
    from daq.store_records import Answer, Measurement
    from sim.unit import Unit

__all__ = [
    "StoredDiagnosis",
    "belief_of",
    "keep_diagnosis",
    "keep_estimate",
    "kept_diagnosis",
    "kept_estimate",
    "loose_answer",
]


@dataclass(frozen=True, slots=True)
class StoredDiagnosis:
    """A diagnosis as a history holds it.

    Parameters
    ----------
    document
        The document of ``diagnose --json``.
    made
        When, ISO 8601, UTC.
    software
        By what.
    """

    document: Mapping[str, Any]
    made: str
    software: str

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --json``."""
        return dict(self.document)

    @property
    def origin(self) -> str:
        """When it was made and by what, in words."""
        return f"from the history, made {self.made[:16].replace('T', ' ')} UTC by {self.software}"

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        causes = " with ".join(cause["effect"] for cause in self.document["causes"])
        said = f"{self.document['verdict']}: {causes}" if causes else self.document["verdict"]
        return [f"{said} ({self.origin})"]


def software() -> str:
    """Name and version of this program."""
    from importlib.metadata import version

    return f"lashbench {version('lashbench')}"


def belief_of(unit: Unit) -> str:
    """Digest of what an answer depends on of a unit: its values and their tolerances."""
    believed = [unit.physics, unit.tolerances]
    return hashlib.sha256(json.dumps(believed, sort_keys=True).encode()).hexdigest()


def kept_estimate(store: Store, measurement: int, unit: Unit) -> Mapping[str, Any] | None:
    """The estimate that a history holds of a measurement, if it is what would be made today.

    None where there is none or it failed, where points were taken since, where other
    values or tolerances of the unit are believed now, and where the inference has changed.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from analysis.edition import EDITION

    found = store.estimate_in_force(measurement)
    if found is None or (found.edition, found.physics) != (EDITION, belief_of(unit)):
        return None
    if "contribution_ratio" not in found.document:
        return None
    _check_shape(store, measurement, "estimate", found.document)
    return found.document


def keep_estimate(
    db: HistoryPlace,
    measured: Measurement,
    document: Mapping[str, Any],
    *,
    unit: Unit | None = None,
    elapsed_s: float | None = None,
) -> None:
    """Keep what was estimated of a measurement; it counts for the points that it was made of.

    Parameters
    ----------
    measured
        The measurement as it was read before its points were.
    unit
        With which it was estimated; the one as it was measured, if left out. With other
        values or tolerances than that it is not kept: the history shows those as measured.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from analysis.edition import EDITION
    from daq.store import Store

    belief = _belief_as_measured(measured)
    if unit is not None and belief != belief_of(unit):
        return
    with Store(db) as store:
        store.add_estimate(
            measured.id, software(), document, points_version=measured.points_version,
            physics=belief, edition=EDITION, elapsed_s=elapsed_s,
        )  # fmt: skip


def loose_answer(document: Mapping[str, Any]) -> Answer:
    """An estimate that could not be kept, as a history would list it."""
    from datetime import UTC, datetime

    from analysis.edition import EDITION
    from daq.store_records import Answer

    return Answer(datetime.now(UTC).isoformat(), software(), EDITION, document)


def kept_diagnosis(store: Store, measurement: int, unit: Unit) -> StoredDiagnosis | None:
    """The diagnosis that a history holds of a measurement, if it is what would be made today.

    As `kept_estimate`, and by this version of the program.
    """
    from analysis.edition import EDITION

    today = (belief_of(unit), EDITION, software())
    for found in store.diagnoses_in_force(measurement):
        if (found.physics, found.edition, found.software) == today:
            _check_shape(store, measurement, "diagnosis", found.document)
            return StoredDiagnosis(found.document, found.made, found.software)
    return None


def keep_diagnosis(
    db: HistoryPlace,
    measurement: int,
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    document: Mapping[str, Any],
) -> None:
    """Keep what was diagnosed of a measurement; it counts for the points that it was made of.

    Parameters
    ----------
    responses
        What was diagnosed together, as the history gave it.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from analysis.edition import EDITION
    from daq.store import Store

    seen = [response.provenance for response in responses]
    points = {int(one["measurement_id"]): int(one["points_version"]) for one in seen}
    belief, elapsed = belief_of(unit), document.get("elapsed_s")
    with Store(db) as store:
        as_measured = _belief_as_measured(store.measurement(measurement)) == belief
        store.add_diagnosis(
            measurement, software(), document, points, physics=belief, as_measured=as_measured,
            edition=EDITION, elapsed_s=elapsed if isinstance(elapsed, int | float) else None,
        )  # fmt: skip


def _belief_as_measured(measured: Measurement) -> str:
    """Digest for the unit as its file was then; none where the history does not hold it."""
    try:
        return belief_of(unit_as_measured(measured))
    except ConfigurationError:
        return ""


def _check_shape(store: Store, measurement: int, kind: str, document: Mapping[str, Any]) -> None:
    """Raise a FileFormatError where a stored document is none that this program wrote."""
    from tui.measurements.stored_shapes import fault_of

    fault = fault_of(kind, document)
    if fault:
        raise FileFormatError(
            f"{store.path}: the {kind} of measurement {measurement} cannot be read ({fault}); "
            "restore a copy"
        )
