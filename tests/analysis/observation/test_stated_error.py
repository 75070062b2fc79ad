"""An error column is compared with simulated scatter only where it is said to be scatter."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.observation.observation import observe
from analysis.observation.stated_error import error_doubts, error_notes, stated_error
from daq.errors import InputError
from daq.formats import read_response, write_response
from daq.frf import error_words
from daq.plan import SweepPlan
from sim.response import simulate
from sim.unit import load_unit
from tui.cli import main

PRACTICE = Path(__file__).parents[2] / "data" / "practice"
PLAN = SweepPlan(tuple(np.linspace(100.0, 180.0, 41)), (2.5,), settle_cycles=10)


@pytest.fixture(scope="module")
def swept():
    """A simulated sweep, as any written by this program."""
    return simulate(load_unit("adss"), 0.5, PLAN)


def foreign(response, errors, **provenance):
    """The same readings with an error column of somebody else."""
    known = {"kind": "measured", **provenance}
    return replace(response, gain_std_db=np.broadcast_to(errors, len(response)), provenance=known)


def same(one, other):
    """Whether everything that simulations are compared with is the same."""
    return (
        np.array_equal(one.values, other.values, equal_nan=True)
        and np.array_equal(one.noise, other.noise)
        and (one.noise_v, one.loudest_v) == (other.noise_v, other.loudest_v)
    )


def columns():
    rng = np.random.default_rng(5)
    yield from (0.05, 0.2, 0.5)
    yield 0.2 * np.exp(rng.normal(size=41))
    yield np.linspace(0.05, 1.0, 41)


@pytest.mark.parametrize("errors", list(columns()))
def test_undeclared_error_column_changes_nothing(swept, errors):
    without, given = foreign(swept, np.nan), foreign(swept, errors)
    assert same(observe(given), observe(without))
    assert not same(observe(swept), observe(without))
    assert error_doubts([without]) == []
    (doubt,) = error_doubts([given])
    assert "taken for an error bar" in doubt
    assert f"gain_std_is = '{error_words(30)}'" in doubt


@pytest.mark.parametrize("errors", list(columns())[:4])
def test_cycles_without_kind_leave_error_unused(swept, errors, tmp_path):
    path = tmp_path / "theirs.csv"
    write_response(foreign(swept, errors), path)
    path.write_text(path.read_text().replace('# kind = "measured"\n', ""))
    given = read_response(path)
    (doubt,) = error_doubts([given])
    assert same(observe(given), observe(foreign(given, np.nan)))
    assert "taken for an error bar" in doubt or "the same at every point" in doubt


@pytest.mark.parametrize(
    "words",
    [{"gain_std_components": 1}, {"gain_std_is": error_words(30)}],
)
def test_declared_constant_errors_are_no_scatter(swept, words):
    assert stated_error(foreign(swept, swept.gain_std_db, **words)).doubt == ""
    assert same(observe(foreign(swept, swept.gain_std_db, **words)), observe(swept))
    constant = foreign(swept, 0.2, **words)
    assert same(observe(constant), observe(foreign(swept, np.nan)))
    assert "the same at every point" in error_doubts([constant])[0]


def test_error_words_are_read_as_written(swept):
    said = {"gain_std_is": " Cycle-to-cycle scatter, standard error of the mean over 30 cycles"}
    assert stated_error(foreign(swept, swept.gain_std_db, **said)).components == 1
    both = foreign(swept, np.sqrt(2.0) * swept.gain_std_db, gain_std_is=error_words(30, 2))
    np.testing.assert_allclose(observe(both).values[2], observe(swept).values[2])
    bar = foreign(swept, swept.gain_std_db, gain_std_is="error bar", gain_std_components=1)
    assert same(observe(bar), observe(foreign(swept, np.nan)))
    for odd in (3, ["x"], "scatter of 30 cycles", "x" * 500):
        (doubt,) = error_doubts([foreign(swept, swept.gain_std_db, gain_std_is=odd)])
        assert "taken for an error bar" in doubt
        assert len(doubt) < 400


def test_contradictory_cycles_are_refused_missing_are_taken(swept):
    said = {"gain_std_is": error_words(12)}
    with pytest.raises(InputError, match="counts 12 cycles and integrate_cycles is 30"):
        observe(foreign(swept, swept.gain_std_db, **said))
    lacking = replace(foreign(swept, swept.gain_std_db, **said), integrate_cycles=None)
    ((plan, _),) = observe(lacking).plans
    assert plan.integrate_cycles == 12


@pytest.mark.parametrize("path", sorted(PRACTICE.glob("*.csv")), ids=lambda p: p.stem)
def test_plain_format_errors_are_component_scatter(path):
    response = read_response(path)
    assert stated_error(response).components == 2
    scatter = np.exp(observe(response).values[2])
    stated = np.concatenate([response.at_level(v).gain_std_db for v in response.levels_vpk])
    read = np.isfinite(scatter)
    np.testing.assert_allclose(scatter[read], stated[read] * np.log(10.0) / 20.0, rtol=1e-6)
    assert error_doubts([response]) == []
    (note,) = error_notes([response])
    assert "taken for cycle-to-cycle scatter of both components" in note


@pytest.mark.parametrize("suffix", ["csv", "h5", "uff", "mat"])
def test_written_file_states_meaning_of_its_errors(swept, suffix, tmp_path):
    path = tmp_path / f"x.{suffix}"
    write_response(swept, path)
    back = read_response(path)
    assert back.provenance["gain_std_is"] == error_words(30)
    assert stated_error(back).components == 1
    assert error_doubts([back]) == []


def test_estimate_states_which_error_it_used(tmp_path, capsys):
    few = replace(
        PLAN, frequencies_hz=PLAN.frequencies_hz[::3], settle_cycles=5, integrate_cycles=6
    )
    swept, answers = simulate(load_unit("adss"), 0.5, few), {}
    for name, errors in (("constant", 0.05), ("none", np.nan)):
        path = tmp_path / f"{name}.csv"
        write_response(foreign(swept, errors), path)
        assert main(["estimate", str(path), "--unit", "adss", "--json"]) == 0
        answers[name] = json.loads(capsys.readouterr().out)
    ratio = {name: one["contribution_ratio"] for name, one in answers.items()}
    assert ratio["constant"] == ratio["none"]
    assert any("taken for an error bar" in text for text in answers["constant"]["warnings"])
    assert answers["none"]["warnings"] == []
