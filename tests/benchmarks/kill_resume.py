"""Kill a measuring program thirty times at random moments, go on, and compare with unbroken runs.

Run as ``python tests/benchmarks/kill_resume.py [KILLS]``. Two devices hang
behind a simulated analyser on TCP: a linear one with a known answer, where
the resumed measurement must equal the unbroken one to the last digit, and a
gimbal with play, where it must lie as close to unbroken ones as they lie to
each other.
"""

import random
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from instruments.bench_server import gimbal_analyser, linear_analyser, served  # noqa: E402
from instruments.fake_analyser import known_gain  # noqa: E402
from instruments.killed import begun, check_kept, end, killed_after, start  # noqa: E402

from daq.store import Store  # noqa: E402

PLAN = (120.0, 170.0, 11, 10, 15, 2.0, 2.5)
UNBROKEN = 8
"""Measurements whose median and spread the others are held against; and as many others."""
SEED = 20031


def measured(db: Path, url: str, number: int) -> np.ndarray:
    """An unbroken measurement."""
    assert end(start(url, db, 0, PLAN)).done
    return response(db, number)


def response(db: Path, number: int) -> np.ndarray:
    """Gains of a complete measurement, in the order of the plan."""
    with Store(db) as store:
        found = store.measurement(number)
        assert found.state == "complete", found.state
        assert found.points == 22
        return store.response(number).gain


def killed_and_resumed(
    db: Path, url: str, number: int, chance: random.Random
) -> tuple[np.ndarray, int]:
    """A measurement with a kill in it, and how many points the killed program had told."""
    points = chance.randrange(0, 21)
    seconds = chance.uniform(0.0, 0.05) if points else chance.uniform(0.0, 0.6)
    left = killed_after(points, seconds, url, db, 0, PLAN)
    assert not left.done
    if begun(db, number):
        check_kept(db, number, left.told)
    assert end(start(url, db, begun(db, number), PLAN)).done
    check_kept(db, number, left.told)
    return response(db, number), len(left.told)


def linear(folder: Path, kills: int, chance: random.Random) -> None:
    """Equal to the last digit."""
    db = folder / "linear.db"
    told = []
    with served(linear_analyser(known_gain)) as url:
        unbroken = measured(db, url, 1)
        for kill in range(kills):
            gain, points = killed_and_resumed(db, url, kill + 2, chance)
            np.testing.assert_array_equal(gain, unbroken)
            told.append(points)
    print(
        f"linear device: {kills} kills after {sorted(told)} of 22 points; no point lost, "
        "every resumed response equal to the unbroken one to the last digit"
    )


def decibels(gain: np.ndarray) -> np.ndarray:
    return 20.0 * np.log10(np.abs(gain))


def gimbal(folder: Path, kills: int, chance: random.Random) -> None:
    """As close to unbroken measurements as they are to each other."""
    db = folder / "gimbal.db"
    unbroken = []
    for seed in range(2 * UNBROKEN):
        with served(gimbal_analyser(seed=seed)) as url:
            unbroken.append(decibels(measured(db, url, seed + 1)))
    ensemble, others = np.array(unbroken[:UNBROKEN]), np.array(unbroken[UNBROKEN:])
    centre = np.median(ensemble, axis=0)
    spread = np.maximum(np.std(ensemble, axis=0, ddof=1), 0.1)
    apart, told = [], []
    for kill in range(kills):
        with served(gimbal_analyser(seed=1000 + kill)) as url:
            number = 2 * UNBROKEN + kill + 1
            gain, points = killed_and_resumed(db, url, number, chance)
        apart.append(np.abs(decibels(gain) - centre) / spread)
        told.append(points)
    mine, theirs = np.array(apart), np.abs(others - centre) / spread
    print(f"gimbal: {kills} kills after {sorted(told)} of 22 points; no point lost")
    for name, values in (("other unbroken", theirs), ("resumed", mine)):
        quantiles = np.quantile(values, [0.5, 0.9, 0.99])
        shown = ", ".join(f"{value:.2f}" for value in quantiles)
        print(f"  {name}: distance from the median of {UNBROKEN} unbroken ones, in their")
        print(f"    standard deviations, at 50, 90 and 99 % of the points: {shown}")


def main() -> None:
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    chance = random.Random(SEED)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        linear(Path(folder), kills, chance)
        gimbal(Path(folder), kills, chance)
    print(f"{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
