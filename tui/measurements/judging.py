"""The judgement of a stored measurement, with the answers that its limits ask for.

Owns which stored answers are taken and which are made. What cannot be had leaves its limits
undecided, with the reason. It drives no instrument and prints nothing.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from daq.errors import AnalysisError, ConfigurationError, InputError, LashbenchError
from daq.servers.place import HistoryPlace
from tui.judging import features_for
from tui.measurements.measured_unit import unit_as_measured
from tui.places import cache_folder

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from analysis.execution.progress import Progress
    from daq.frf import FrequencyResponse
    from daq.store import Store
    from daq.store_records import HistoryLine, Measurement
    from sim.unit import Unit

__all__ = ["judge_line", "judge_measurement"]


def judge_measurement(
    db: HistoryPlace,
    measurement: int,
    limits: LimitSet,
    *,
    diagnose: bool = False,
    progress: Progress | None = None,
) -> Judgement:
    """Judge a complete measurement; what is estimated or diagnosed for that is kept.

    Parameters
    ----------
    diagnose
        Make a diagnosis where a limit needs one and none is stored. Without it such a limit
        stays undecided.

    Raises
    ------
    LashbenchError
        If the history cannot be read, or does not hold the measurement or its unit.
    """
    from analysis.acceptance import judge
    from analysis.observation.incomplete import state_doubt
    from analysis.observation.input_check import check_inputs
    from daq.store import Store
    from tui.measurements.stored_answers import kept_diagnosis, kept_estimate

    with Store(db, read_only=True) as store:
        measured = store.measurement(measurement)
        unit = unit_as_measured(measured)
        response = store.response(measurement)
        # The stored estimate takes the total backlash as known.
        stored = None if limits.limits_total else kept_estimate(store, measurement, unit)
        diagnosis = kept_diagnosis(store, measurement, unit)
    case = _Case(db, measured, response, unit, progress)
    doubts = check_inputs([response], unit, as_is=True)
    doubts += filter(None, [state_doubt(measured.state)])
    estimate = stored
    told = None if diagnosis is None else diagnosis.to_json()
    if told is None and diagnose and not doubts:
        told = case.diagnosed()
    if estimate is None and told is None and limits.needs_estimate and not doubts:
        estimate = case.estimated(limits.limits_total)
    return judge(
        limits,
        features=features_for(limits, [response]),
        estimate=estimate,
        diagnosis=told,
        doubt="; ".join(doubts),
    )


def judge_line(store: Store, line: HistoryLine, limits: LimitSet) -> Judgement:
    """Judge a measurement of a list by what the history holds; nothing is estimated.

    Its points are read only where a limit is of ARF, RF or damping.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from analysis.acceptance import judge
    from analysis.edition import EDITION
    from analysis.observation.incomplete import state_doubt
    from analysis.observation.input_check import check_inputs

    told = {"estimate": line.estimate, "diagnosis": line.diagnosis}
    doubts = [
        f"the {kind} is of an earlier edition of the inference"
        for kind, kept in told.items()
        if kept is not None and kept.edition != EDITION
    ]
    doubts += filter(None, [state_doubt(line.state)])
    features = None
    if limits.needs_features and line.points:
        response = store.response(line.id)
        features = features_for(limits, [response])
        # A stored answer of a mistaken response is in force nowhere; its features would be.
        try:
            unit = unit_as_measured(store.measurement(line.id))
            doubts += check_inputs([response], unit, as_is=True)
        except (ConfigurationError, InputError) as error:
            doubts.append(str(error))
    return judge(
        limits,
        features=features,
        estimate=None if line.estimate is None else line.estimate.summary,
        diagnosis=None if line.diagnosis is None else line.diagnosis.summary,
        doubt="; ".join(doubts),
    )


@dataclass(frozen=True, slots=True)
class _Case:
    """A measurement and how answers of it are made and kept."""

    db: HistoryPlace
    measured: Measurement
    response: FrequencyResponse
    unit: Unit
    progress: Progress | None

    def estimated(self, with_total: bool) -> dict[str, Any]:
        """The document of an estimate, or why there is none."""
        from analysis.estimate import estimate_response
        from tui.measurements.stored_answers import keep_estimate

        began_s = time.monotonic()
        try:
            result = estimate_response(
                self.response, self.unit, with_total and self.unit.stages > 1,
                progress=self.progress, cache=cache_folder(),
            )  # fmt: skip
        except (AnalysisError, InputError) as error:
            return {"failed": str(error)}
        document = result.to_json()
        if not with_total:
            # It counts, kept or not.
            with suppress(LashbenchError):
                elapsed_s = time.monotonic() - began_s
                keep_estimate(self.db, self.measured, document, unit=self.unit, elapsed_s=elapsed_s)
        return document

    def diagnosed(self) -> dict[str, Any] | None:
        from analysis.diagnosis import diagnose_response
        from tui.measurements.stored_answers import keep_diagnosis

        try:
            made = diagnose_response(
                self.response, self.unit, cache=cache_folder(), progress=self.progress
            )
        except (AnalysisError, InputError):
            return None
        document = made.to_json()
        with suppress(LashbenchError):
            keep_diagnosis(self.db, self.measured.id, [self.response], self.unit, document)
        return document
