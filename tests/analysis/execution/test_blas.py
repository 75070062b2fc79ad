"""Linear algebra on one core: inside every analysis, and no longer than that."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import analysis.diagnosis.diagnose
import analysis.estimate.estimate
import analysis.estimate.from_features
import analysis.paper.reproduction
import analysis.paper_diagnosis.diagnose
from analysis.execution.blas import on_one_core
from sim.unit import load_unit


def cores():
    """How many the linear algebra of numpy and scipy would take now."""
    assert np.linalg.inv(np.eye(2)).trace() == 2.0
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.fixture
def two():
    with threadpool_limits(limits=2, user_api="blas"):
        assert cores() == {2}
        yield
        assert cores() == {2}


def test_blas_uses_one_core_inside_only(two):
    with on_one_core():
        assert cores() == {1}
        with on_one_core():
            assert cores() == {1}
        assert cores() == {1}


def test_error_restores_the_cores(two):
    with pytest.raises(ZeroDivisionError), on_one_core():
        raise ZeroDivisionError


class Asked(Exception):
    """Somebody began to compute."""


@pytest.mark.parametrize(
    ("module", "begin", "call"),
    [
        (analysis.diagnosis.diagnose, "check_together", lambda m: m.diagnose_response(None, None)),
        (analysis.estimate.estimate, "check_together", lambda m: m.estimate_response(None, None)),
        (
            analysis.estimate.from_features,
            "fit_features",
            lambda _: analysis.estimate.estimate_features(128.0, 137.0, load_unit("adss")),
        ),
        (analysis.paper.reproduction, "load_paper", lambda m: m.reproduce()),
        (
            analysis.paper_diagnosis.diagnose,
            "search_sets",
            lambda m: m.diagnose_paper(load_unit("adss")),
        ),
    ],
)
def test_every_analysis_uses_one_blas_core(two, monkeypatch, module, begin, call):
    seen = []

    def asked(*_, **__):
        seen.append(cores())
        raise Asked

    monkeypatch.setattr(module, begin, asked)
    with pytest.raises(Asked):
        call(module)
    assert seen == [{1}]
