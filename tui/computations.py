"""What verbs compute with: each is loaded when it is called, and others may be handed to `main`.

Owns the list of them. It computes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.diagnosis import Diagnosis
    from analysis.estimate import Estimate
    from analysis.execution.dask_executor import ClusterExecutor
    from analysis.paper import Reproduction
    from analysis.paper_diagnosis import PaperDiagnosis

__all__ = ["Computations"]


def _estimate_response(*given: Any, **options: Any) -> Estimate:
    from analysis.estimate import estimate_response

    return estimate_response(*given, **options)


def _estimate_features(*given: Any, **options: Any) -> Estimate:
    from analysis.estimate import estimate_features

    return estimate_features(*given, **options)


def _diagnose_response(*given: Any, **options: Any) -> Diagnosis:
    from analysis.diagnosis import diagnose_response

    return diagnose_response(*given, **options)


def _diagnose_paper(*given: Any, **options: Any) -> PaperDiagnosis:
    from analysis.paper_diagnosis import diagnose_paper

    return diagnose_paper(*given, **options)


def _draw_diagnosis(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    from analysis.diagnosis.figures import draw_diagnosis

    return draw_diagnosis(diagnosis, folder)


def _reproduce(**options: Any) -> Reproduction:
    from analysis.paper import reproduce

    return reproduce(**options)


def _cluster(address: str) -> ClusterExecutor:
    from analysis.execution.dask_executor import ClusterExecutor

    return ClusterExecutor(address)


@dataclass(frozen=True, slots=True)
class Computations:
    """Functions of `analysis` by their names there; `cluster` connects to a Dask scheduler."""

    estimate_response: Callable[..., Estimate] = _estimate_response
    estimate_features: Callable[..., Estimate] = _estimate_features
    diagnose_response: Callable[..., Diagnosis] = _diagnose_response
    diagnose_paper: Callable[..., PaperDiagnosis] = _diagnose_paper
    draw_diagnosis: Callable[[Diagnosis, Path], list[Path]] = _draw_diagnosis
    reproduce: Callable[..., Reproduction] = _reproduce
    cluster: Callable[[str], ClusterExecutor] = _cluster
