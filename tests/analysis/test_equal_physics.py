"""Equal physics gives equal answers: no name, limit, comment or file format takes part."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from usual_runs import usual_families, usual_sweep

from analysis.ensemble.model import Hypothesis
from analysis.ensemble.run_cache import run_name
from analysis.estimate import estimate_response
from analysis.inference.checkpoint import posterior_name
from analysis.observation.joint import check_together
from analysis.observation.observation import observe
from daq.configs import config_path
from daq.errors import InputError
from daq.formats import read_response, write_response
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan
from sim.catalogue import CATALOGUE
from sim.response import simulate
from sim.unit import load_unit

FORMATS = ("csv", "h5", "uff", "mat")


def renamed(name: str, folder: Path) -> str:
    """The file of a unit under another name, with other limits and comments."""
    text = Path(config_path("units", name)).read_text()
    head, _, rest = text.partition("[limits]")
    tolerance = rest[rest.index("[tolerance]") :]
    head = head.replace(f'name = "{name.upper()}"', 'name = "mine"  # of ours')
    limits = "source_vpk = 4.2\nsource_offset_v = 0.5\nstart_hz = 35\nstop_hz = 410.0\n"
    path = folder / "mine.toml"
    path.write_text(f"{head}[limits]\n{limits}b1_deg = 0.2\nb2_deg = 0.01\n{tolerance}")
    assert load_unit(str(path)).name == "mine"
    return str(path)


def through(format_: str, response: FrequencyResponse, folder: Path) -> FrequencyResponse:
    path = folder / f"response.{format_}"
    write_response(response, path)
    return read_response(path)


@pytest.mark.parametrize("name", ["adss", "edss"])
def test_renamed_unit_finds_its_stored_runs(name, tmp_path):
    unit, mine = load_unit(name), load_unit(renamed(name, tmp_path))
    sweep, family = usual_sweep(name), usual_families(name)[0]
    assert posterior_name(mine) == posterior_name(unit)
    assert run_name(mine, family, sweep) == run_name(unit, family, sweep)


def test_every_parameter_distinguishes_units():
    unit, sweep, family = load_unit("adss"), usual_sweep("adss"), usual_families("adss")[0]
    others = [unit.with_parameters(**{s: 1.01 * v}) for s, v in unit.parameters.items()]
    for names in (
        [posterior_name(one) for one in (unit, *others)],
        [run_name(one, family, sweep) for one in (unit, *others)],
    ):
        assert len(set(names)) == len(others) + 1


@pytest.mark.parametrize("name", ["adss", "edss"])
def test_limits_do_not_change_cause_ranges(name, tmp_path):
    unit, mine = load_unit(name), load_unit(renamed(name, tmp_path))
    for effect in CATALOGUE:
        logs = [Hypothesis(one, (effect,)).logs for one in (unit, mine)]
        np.testing.assert_array_equal(*logs)


@pytest.mark.long
def test_name_limits_and_format_keep_estimate(tmp_path):
    plan = SweepPlan((110.0, 122.0, 128.0, 134.0, 140.0, 152.0), (1.5, 3.0), "up", 6, 6)
    measured = simulate(load_unit("adss"), 0.4, plan, seed=3)
    mine = load_unit(renamed("adss", tmp_path))
    found = [estimate_response(measured, load_unit("adss")).to_json()]
    found += [
        estimate_response(through(one, measured, tmp_path), mine).to_json() for one in FORMATS
    ]
    assert {one.pop("unit") for one in found} == {"ADSS", "mine"}
    for one in found[1:]:
        assert one == found[0]


def test_copy_in_another_format_is_equal(tmp_path):
    plan = SweepPlan((110.0, 122.0), (1.5,), "up", 6, 6)
    measured = simulate(load_unit("adss"), 0.4, plan, seed=3)
    copies = [through(one, measured, tmp_path) for one in ("csv", "h5")]
    with pytest.raises(InputError, match="given twice"):
        check_together(copies)


READINGS = st.integers(1, 8).flatmap(
    lambda rows: st.tuples(
        st.lists(st.floats(1.0, 1e4), min_size=rows, max_size=rows, unique=True),
        st.floats(1e-3, 100.0),
        st.lists(st.floats(-120.0, 60.0), min_size=rows, max_size=rows),
        st.lists(st.none() | st.floats(-3.14, 3.14), min_size=rows, max_size=rows),
        st.lists(st.just(np.nan) | st.floats(1e-6, 3.0), min_size=rows, max_size=rows),
    )
)


@settings(max_examples=5, deadline=None)  # each writes four files, and starts programs
@given(READINGS)
def test_every_format_gives_the_same_observation(readings):
    frequency, level, gain_db, phase, std = readings
    known = np.array([one is not None for one in phase])
    angle = np.array([one or 0.0 for one in phase])
    order = np.argsort(frequency)
    response = FrequencyResponse.from_arrays(
        np.sort(frequency),
        level,
        (10.0 ** (np.array(gain_db) / 20.0) * np.exp(1j * angle))[order],
        unit="ADSS",
        phase_known=known[order],
        gain_std_db=np.array(std)[order],
    )
    try:
        seen = observe(response)
    except InputError:  # no bench has such voltages, or sweeps for so long
        return
    with TemporaryDirectory() as folder:
        for one in FORMATS:
            other = observe(through(one, response, Path(folder)))
            np.testing.assert_array_equal(other.values, seen.values)
            np.testing.assert_array_equal(other.noise, seen.noise)
            np.testing.assert_array_equal(other.floor, seen.floor)
            assert other.noise_v == seen.noise_v
            assert other.plans[0][0] == seen.plans[0][0]
