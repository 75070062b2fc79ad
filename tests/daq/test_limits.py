"""Limits of bench, unit and recipe: none loosens another, and all are named at once."""

import math

import pytest

from daq.configs import config_names
from daq.errors import ConfigurationError, InputError, LimitError
from daq.limits import Limits, check_plan, load_bench, tightest
from daq.plan import SweepPlan
from daq.recipe import load_recipe

BENCH = Limits("bench b", source_vpk=5.0, source_offset_v=2.0, source_peak_v=6.0, start_hz=1.0,
               stop_hz=2000.0, duration_s=1000.0)  # fmt: skip
UNIT = Limits("unit u", source_vpk=3.0, start_hz=10.0, stop_hz=500.0)


def plan(**changes) -> SweepPlan:
    return SweepPlan(
        **({"frequencies_hz": (20.0, 40.0), "levels_vpk": (1.0, 3.0), "settle_cycles": 5,
            "integrate_cycles": 5} | changes)
    )  # fmt: skip


def test_a_plan_at_every_bound_passes():
    check_plan(plan(frequencies_hz=(10.0, 500.0), dc_offset_v=-2.0), [BENCH, UNIT])
    check_plan(plan(levels_vpk=(3.0,), dc_offset_v=2.0), [BENCH, UNIT], duration_s=1000.0)
    check_plan(plan(), [])


@pytest.mark.parametrize(
    ("changes", "faults"),
    [
        ({"levels_vpk": (3.001,)}, ["source level 3.001 V peak is above the 3 V peak of unit u"]),
        ({"dc_offset_v": -2.5}, ["source offset 2.5 V is above the 2 V of bench b"]),
        ({"frequencies_hz": (9.9, 20.0)}, ["frequency 9.9 Hz is below the 10 Hz of unit u"]),
        ({"frequencies_hz": (20.0, 500.1)}, ["frequency 500.1 Hz is above the 500 Hz of unit u"]),
        ({"settle_cycles": 100_000}, ["duration", "above the 1000 s of bench b"]),
        (
            {"levels_vpk": (5.5,), "dc_offset_v": 1.0},
            [
                "source level 5.5 V peak is above the 5 V peak of bench b",
                "source level 5.5 V peak is above the 3 V peak of unit u",
                "level plus offset 6.5 V is above the 6 V of bench b",
            ],
        ),
    ],
)
def test_exceeded_limits_are_named_with_origin(changes, faults):
    with pytest.raises(LimitError) as refusal:
        check_plan(plan(**changes), [BENCH, UNIT])
    assert refusal.value.exit_code == 5
    assert all(fault in str(refusal.value) for fault in faults)
    assert "\n" not in str(refusal.value)


def test_highest_level_is_checked_anywhere():
    with pytest.raises(LimitError, match="source level 4"):
        check_plan(plan(levels_vpk=(4.0, 1.0)), [UNIT])


def test_overhead_counts_towards_the_duration():
    with pytest.raises(LimitError, match="duration 1001 s"):
        check_plan(plan(), [BENCH], duration_s=1001.0)
    # A duration said to be shorter than the plan's own cycles is not believed.
    with pytest.raises(LimitError, match="duration"):
        check_plan(plan(settle_cycles=100_000), [BENCH], duration_s=1.0)


def test_looser_recipe_does_not_relax_limits():
    loose = Limits("recipe r", source_vpk=math.inf, stop_hz=1e6)
    with pytest.raises(LimitError, match="unit u"):
        check_plan(plan(levels_vpk=(4.0,)), [BENCH, UNIT, loose])
    assert tightest([BENCH, UNIT, loose]).source_vpk == 3.0


def test_the_tightest_of_each():
    both = tightest([BENCH, UNIT])
    assert (both.source_vpk, both.start_hz, both.stop_hz) == (3.0, 10.0, 500.0)
    assert (both.source_peak_v, both.duration_s) == (6.0, 1000.0)
    assert tightest([]).source_vpk == math.inf


# Files


def test_shipped_benches_are_complete():
    for name in config_names("benches"):
        bounds = load_bench(name).bounds()
        assert bounds.set_by.startswith("bench ")
        assert 0 < bounds.start_hz < bounds.stop_hz < math.inf


def test_shipped_recipes_keep_own_and_bench_limits():
    names = config_names("recipes")
    assert {"adss", "edss"} <= set(names)
    for name in names:
        recipe = load_recipe(name)
        check_plan(recipe.plan(), [recipe.bounds(), load_bench().bounds()])


GOOD = """
schema = 1
name = "b"
[limits]
source_vpk = 5
source_offset_v = 0
source_peak_v = 6.0
start_hz = 1.0
stop_hz = 2000.0
duration_s = 100
[drive]
slew_vpk_per_s = 10.0
"""


def test_a_bench_file(tmp_path):
    path = tmp_path / "b.toml"
    path.write_text(GOOD)
    bench = load_bench(str(path))
    assert bench.bounds().source_vpk == 5.0
    assert bench.drive.channel1_range_vpk is None


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("source_vpk = 5", "", "limits.source_vpk: Field required"),
        ("source_vpk = 5", "source_vpk = 0", "limits.source_vpk"),
        ("source_vpk = 5", "source_vpk = nan", "limits.source_vpk"),
        ("source_vpk = 5", 'source_vpk = "5"', "limits.source_vpk"),
        ("source_vpk = 5", "source_vpk = true", "limits.source_vpk"),
        ("schema = 1", "schema = 2", "schema"),
        ("[drive]", "[drive]\nsource = 1", "drive.source: Extra inputs"),
        ("duration_s = 100", "duration_s = inf", "limits.duration_s"),
        ('name = "b"', "name =", "is not valid TOML"),
    ],
)
def test_a_wrong_bench_file_is_refused_whole(tmp_path, old, new, fault):
    path = tmp_path / "b.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(ConfigurationError) as refusal:
        load_bench(str(path))
    assert fault in str(refusal.value)
    assert str(path) in str(refusal.value)


def test_every_fault_of_a_file_is_named(tmp_path):
    path = tmp_path / "b.toml"
    path.write_text(GOOD.replace("source_vpk = 5", "x = 1").replace("stop_hz = 2000.0", ""))
    with pytest.raises(ConfigurationError) as refusal:
        load_bench(str(path))
    assert all(key in str(refusal.value) for key in ("source_vpk", "stop_hz", "limits.x"))


RECIPE = """
schema = 1
name = "r"
[sweep]
levels_vpk = [2.5, 1]
start_hz = 100
stop_hz = 200.0
points = 3
spacing = "lin"
direction = "down"
[limits]
source_vpk = 2.0
"""


def test_a_recipe_file(tmp_path):
    path = tmp_path / "r.toml"
    path.write_text(RECIPE)
    recipe = load_recipe(str(path))
    assert recipe.plan().frequencies_hz == (100.0, 150.0, 200.0)
    assert recipe.plan().levels_vpk == (2.5, 1.0)
    assert recipe.plan().direction == "down"
    assert recipe.bounds().source_peak_v == math.inf
    with pytest.raises(LimitError, match="recipe r"):
        check_plan(recipe.plan(), [BENCH, recipe.bounds()])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[2.5, 1]", "[]"),
        ("[2.5, 1]", "[0.0]"),
        ("points = 3", "points = 3.0"),
        ("points = 3", "points = 1"),
        ('"lin"', '"cubic"'),
        ('"down"', '"sideways"'),
        ("[limits]", "[limit]"),
    ],
)
def test_a_wrong_recipe_is_refused(tmp_path, old, new):
    path = tmp_path / "r.toml"
    path.write_text(RECIPE.replace(old, new, 1))
    with pytest.raises(ConfigurationError):
        load_recipe(str(path))


def test_empty_band_makes_no_plan(tmp_path):
    path = tmp_path / "r.toml"
    path.write_text(RECIPE.replace("stop_hz = 200.0", "stop_hz = 50.0"))
    with pytest.raises(InputError, match="stop must lie above"):
        load_recipe(str(path)).plan()
