"""The diagnosis from features alone: hidden causes are found, and little is claimed from little."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from analysis.ensemble.model import Hypothesis
from analysis.paper_diagnosis import diagnose_features, diagnose_paper, paper_reading
from analysis.paper_diagnosis.evidence import RatioPrior
from analysis.paper_diagnosis.features import Reading, plan_about
from analysis.paper_diagnosis.pairs import DISSIPATION, possible_pairs
from analysis.paper_diagnosis.posterior import Knowledge, believe
from analysis.paper_diagnosis.simulation import Effort, Explored, Explorer
from daq.errors import InputError
from sim.catalogue import CATALOGUE
from sim.unit import load_unit

QUICK = Effort(
    lanes=8,
    points=22,
    settle_cycles=12,
    integrate_cycles=8,
    baseline=2,
    first=4,
    further=0,
    refined=2,
    refinement=1,
    pairs=0,
    places=2,
)
OFFERED = ("load-inertia", "total-backlash", "tachometer-gain")
LEFT_OUT = tuple(effect for effect in CATALOGUE if effect not in OFFERED)
STD = np.array([0.5, 0.5, 0.5, 0.5, 2.0])
RATIO = 0.05
KNOWN = Knowledge(RatioPrior(RATIO, 0.02))


@pytest.fixture(scope="module")
def explorer() -> Explorer:
    """An EDSS of which every test here sees the same sweeps."""
    about = Reading(np.array([45.0, -20.0, 75.0, -4.0, 6.0]), STD)
    plan = plan_about(about, points=22, settle_cycles=12, integrate_cycles=8)
    return Explorer(load_unit("edss"), plan, QUICK, RATIO, np.random.default_rng(1))


@pytest.fixture(scope="module")
def explored(explorer: Explorer) -> list[Explored]:
    """The plain model and three causes, simulated once."""
    causes = [(), *((effect,) for effect in OFFERED)]
    hypotheses = [Hypothesis(explorer.unit, effects) for effects in causes]
    return [explorer.explore(one, QUICK.groups(one)) for one in hypotheses]


def read_hidden(explorer: Explorer, effect: str | None, value: float, count: int) -> list[Reading]:
    """What single sweeps of a machine that hides one effect are read as, reading error added."""
    rng = np.random.default_rng()
    hypothesis = Hypothesis(explorer.unit, () if effect is None else (effect,))
    place = hypothesis.place(RATIO, [] if effect is None else [value])
    own = replace(explorer, rng=rng)
    runs = own.run(hypothesis, np.tile(place, (count, 1)))
    return [Reading(run + STD * rng.standard_normal(len(run)), STD) for run in runs]


@pytest.mark.parametrize(
    ("effect", "value"),
    [("load-inertia", 0.0235), ("tachometer-gain", 0.15), ("total-backlash", 0.65)],
)
def test_hidden_cause_explains_its_features(
    effect: str, value: float, explorer: Explorer, explored: list[Explored]
) -> None:
    """Named first in at least 4 of 6 machines, its true size within the error bars told."""
    named, near = 0, 0
    for reading in read_hidden(explorer, effect, value, 6):
        belief = believe(explored, reading, KNOWN)
        one = next(j for j in belief.judged if j.effects == (effect,))
        mean, std = one.agreement.moments()
        truth = one.agreement.hypothesis.place(RATIO, [value])
        named += belief.best is one and belief.word in ("explained", "ambiguous")
        near += abs(mean[1] - truth[1]) < 3.0 * std[1] + 0.02
        assert belief.baseline.probability < one.probability
    assert named >= 4
    assert near >= 4


def test_plain_unit_rarely_gets_a_cause(explorer: Explorer, explored: list[Explored]) -> None:
    """The plain model's own runs: consistent in at least 36 of 60, confidently else in at most 2.

    Of 3000 such readings 2560 were consistent and one was explained by a cause it did not have.
    At these rates the test fails by chance about once in a million.
    """
    words = [
        believe(explored, reading, KNOWN).word for reading in read_hidden(explorer, None, 0.0, 60)
    ]
    assert words.count("consistent") >= 36
    assert words.count("explained") <= 2


def test_plain_model_does_not_explain_withheld_cause(
    explorer: Explorer, explored: list[Explored]
) -> None:
    """Heavy damping is none of what was offered; the plain model must not pass for it."""
    for reading in read_hidden(explorer, "shaft-damping", 0.03, 4):
        belief = believe(explored, reading, KNOWN)
        assert belief.word != "consistent"
        assert not belief.baseline.adequate


def test_excluded_cause_is_not_believed(explorer: Explorer, explored: list[Explored]) -> None:
    (reading,) = read_hidden(explorer, "total-backlash", 0.65, 1)
    knowing = Knowledge(KNOWN.prior, ("total-backlash",))
    belief = believe(explored, reading, knowing)
    assert "total-backlash" not in belief.inclusion()
    assert sum(one.probability for one in belief.judged) == pytest.approx(1.0)


def test_seed_reproduces_the_answer() -> None:
    documents = []
    for _ in range(2):
        found = diagnose_features(
            Reading(np.array([128.0, -22.3, 137.0, -18.6, np.nan]), STD),
            load_unit("adss"),
            without=tuple(e for e in CATALOGUE if e != "tachometer-gain"),
            effort=replace(QUICK, points=16, baseline=1, first=1, refined=0),
            seed=5,
        )
        assert found.known is None
        document = found.to_json()
        assert document["ratio_as_measured"] is None
        documents.append({k: v for k, v in document.items() if k != "elapsed_s"})
    assert documents[0] == documents[1]


def test_document_follows_the_contract_and_is_whole(tmp_path: Path) -> None:
    calls: list[tuple[float, str]] = []
    found = diagnose_paper(
        load_unit("adss"),
        without=[e for e in CATALOGUE if e not in (*OFFERED, "shaft-damping")],
        effort=replace(QUICK, points=18, first=2, pairs=1, pair_groups=2),
        progress=lambda share, text: calls.append((share, text)),
    )
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert document["verdict"] in ("consistent", "explained", "ambiguous", "unexplained")
    for section in (document, document["ratio_as_measured"]):
        for cause in section["causes"]:
            assert set(cause) >= {"effect", "parameters", "probability"}
            for value in cause["parameters"].values():
                assert set(value) == {"value", "std", "unit"}
        for model in ("baseline", "extended"):
            assert set(section[model]) >= {"held_out_rms_sigma", "held_out_rms_db"}
            assert set(section["contribution_ratio"][model]) == {"value", "std"}
        accepted = section["verdict"] in ("consistent", "explained")
        for name in ("b1_deg", "b2_deg", "b_t_deg"):
            assert (section[name] is not None) == accepted
        for entry in (*section["residual"], *section["residual_after"]):
            assert set(entry) >= {"band_hz", "source_vpk", "quantity", "mean", "sigma"}
        index = section["error_index"]
        assert index["fall_hz"]["value"] == pytest.approx(
            index["before"]["expected_hz"] - index["after"]["expected_hz"]
        )
        assert set(section["damping_alone"]) >= {"enough", "causes", "error_index"}
        named = [section["extended"], *section["rivals"]]
        assert sum(one["probability"] for one in named) <= 1.0 + 1e-9
        assert 0.0 <= section["anything_missing"] <= 1.0
    assert document["gain"]["held_out_rms_ratio"] == pytest.approx(
        document["extended"]["held_out_rms_sigma"] / document["baseline"]["held_out_rms_sigma"]
    )
    assert document["ratio_as_measured"]["contribution_ratio"]["extended"][
        "value"
    ] == pytest.approx(0.23, abs=0.05)
    proposal = document["next_measurement"]
    if proposal is not None:
        limits = load_unit("adss").limits
        assert max(proposal["plan"]["levels_vpk"]) <= limits.source_vpk
        assert limits.start_hz <= proposal["plan"]["start_hz"] < proposal["plan"]["stop_hz"]
    assert set(document["procedures"]) == {"from-rest", "swept-up", "swept-down"}
    shares = [share for share, _ in calls]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert any("damping" in text for _, text in calls)
    lines = found.summary()
    assert "128 Hz" in lines[0]
    assert any("missing damping alone" in line for line in lines)
    assert any("the measuring chain is off" in line for line in lines)
    (picture,) = found.plot(tmp_path / "new")
    assert imread(picture)[..., :3].std() > 0.05


def test_the_papers_rows_are_read_as_printed() -> None:
    reading = paper_reading("EDSS")
    assert reading.values[:4].tolist() == [40.0, -14.6, 75.0, -1.8]
    assert reading.values[4] == pytest.approx(2 * 0.135 * 40.0)


def test_every_pair_contains_a_dissipation() -> None:
    pairs = possible_pairs(CATALOGUE)
    n, k = len(CATALOGUE), len(DISSIPATION)
    assert len(pairs) == len(set(pairs)) == k * (n - k) + k * (k - 1) // 2
    assert all(set(pair) & set(DISSIPATION) for pair in pairs)


def test_unit_outside_the_paper_is_refused() -> None:
    with pytest.raises(InputError, match="adss or edss"):
        diagnose_paper(load_unit("adss").model_copy(update={"name": "ADSS2"}))


@pytest.mark.parametrize(("arf", "rf"), [(75.0, 40.0), (np.nan, 40.0), (-1.0, 5.0), (40.0, np.inf)])
def test_impossible_features_are_refused(arf: float, rf: float) -> None:
    reading = Reading(np.array([arf, -20.0, rf, -5.0, np.nan]), STD)
    with pytest.raises(InputError, match="ARF below RF"):
        diagnose_features(reading, load_unit("edss"), effort=QUICK)
