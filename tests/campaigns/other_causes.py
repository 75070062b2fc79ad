"""What is said of causes that are in no catalogue: fifteen of them, in either unit.

A cause that was taken out of the catalogue is one that somebody thought of. These are not in it at
all: some are written into the oracle, an integrator that shares no code with the engine, some
change a datasheet value that no effect changes, some act on what is read. The diagnosis has no
right answer to give; what counts is what it says, and whether anything in the answer warns.

    python tests/campaigns/other_causes.py [sets] [seed] [lines.jsonl]

Every set is kept as a line of JSON, and a study that was interrupted goes on.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_study import CACHE, PAGE
from kept import Kept, drawn_seed
from oracle import rk4
from worlds.hidden import BANDS_HZ, LEVELS_VPK, NOISE_V, off_datasheet
from yardsticks.page import replace_block

from analysis.diagnosis import Diagnosis, diagnose_response
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.plan import spaced_frequencies
from sim.unit import Unit, load_unit, stage_backlash

POINTS = 61
SETTLE, INTEGRATE = 20, 30

Chain = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.complex128]]
"""What the reading is multiplied with at frequencies (Hz), so far (0 to 1) into the measurement."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A cause of some size: extras of the oracle, factors on datasheet values, or of the chain."""

    size: float
    extras: Mapping[str, float] = field(default_factory=dict)
    factors: Mapping[str, float] = field(default_factory=dict)
    chain: Chain | None = None


@dataclass(frozen=True, slots=True)
class OtherCause:
    """`words` of a size for a page, and how one is drawn for a unit."""

    words: Callable[[float], str]
    draw: Callable[[Unit, np.random.Generator], Drawn]


def _off(symbol: str, what: str, *spans: tuple[float, float]) -> OtherCause:
    """A datasheet value, times a factor in one of some spans."""

    def draw(unit: Unit, rng: np.random.Generator) -> Drawn:
        factors = [float(rng.uniform(*span)) for span in spans]
        factor = factors[0] if len(factors) == 1 else float(rng.choice(factors))
        return Drawn(factor, factors={symbol: factor})

    return OtherCause(lambda size: f"{what} at {100 * size:.0f} % of its datasheet's", draw)


def _read(chain: Callable[[float], Chain], low: float, high: float, words: str) -> OtherCause:
    """A fault of the reading."""

    def draw(unit: Unit, rng: np.random.Generator) -> Drawn:
        size = float(rng.uniform(low, high))
        return Drawn(size, chain=chain(size))

    return OtherCause(words.format, draw)


def _added(
    extras: Callable[[Mapping[str, float], float], Mapping[str, float]],
    low: float,
    high: float,
    words: str,
) -> OtherCause:
    """Something in the machine, by the values of its datasheet and a size."""

    def draw(unit: Unit, rng: np.random.Generator) -> Drawn:
        size = float(rng.uniform(low, high))
        return Drawn(size, extras=extras(unit.parameters, size))

    return OtherCause(words.format, draw)


def _coupling(unit: Unit, rng: np.random.Generator) -> Drawn:
    """The tachometer on a shaft of its own, which resonates above what is swept."""
    f_t, zeta = float(rng.uniform(1.5, 3.0)) * BANDS_HZ[unit.name.lower()][1], 0.02
    return Drawn(f_t, chain=lambda hz, _: 1.0 / (1.0 - (hz / f_t) ** 2 + 2j * zeta * hz / f_t))


CAUSES = {
    "delay": _read(
        lambda s: lambda hz, _: np.exp(-2j * np.pi * hz * s), 3e-4, 1e-3, "reading {:.2g} s late"
    ),
    "motor-inertia": _off("J_m", "motor's inertia", (1.2, 1.6), (0.6, 0.8)),
    "mesh1-stiffness": _off("k_g1", "stiffness of mesh 1", (0.05, 0.3)),
    "mesh2-stiffness": _off("k_2", "stiffness of mesh 2", (0.05, 0.3)),
    "cogging": _added(
        lambda p, s: {"T_cog": s * p["T_f_m"]}, 0.5, 3.0, "cogging, {:.2g} of the motor's friction"
    ),
    "dead-zone": _added(
        lambda p, s: {"V_d": s}, 0.1, 0.5, "amplifier with a dead zone of {:.2g} V at the motor"
    ),
    "current-limit": _added(
        lambda p, s: {"i_max": s * 4.0 * p["k_a"] / p["R_m"]},
        0.3,
        0.7,
        "current limit, {:.2g} of what the motor draws when held at 4 V",
    ),
    "air-drag": _added(
        lambda p, s: {"D_L": s * 0.05}, 0.5, 3.0, "drag of air, {:.2g} times 0.05 N.m.s2/rad2"
    ),
    "tachometer-coupling": OtherCause(
        "tachometer's coupling resonates at {:.0f} Hz".format, _coupling
    ),
    "drift": _read(
        lambda s: lambda _, share: 1.0 - s * share + 0j,
        0.05,
        0.2,
        "gain falls by {:.2g} of it on the way",
    ),
    "ac-coupling": _read(
        lambda s: lambda hz, _: 1j * hz / (1j * hz + s), 4.0, 15.0, "input coupled by AC, {:.2g} Hz"
    ),
    "inductance": _off("L_a", "inductance", (2.0, 5.0)),
    "uneven-amplifier": _added(
        lambda p, s: {"u_p": s}, 0.1, 0.4, "amplifier gives {:.2g} more one way"
    ),
    "dahl-friction": _added(
        lambda p, s: {"T_f_L": 2.0 * p["T_f_L"], "s_L": 2.0 * p["T_f_L"] / s},
        2e-4,
        3e-3,
        "load's friction doubled, bending by {:.2g} rad before it slips",
    ),
    "gear-ratio": _off("N_1", "ratio of gear 1", (0.85, 0.95)),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Outside:
    """A response, and what is in it; `drawn` is the cause at its size."""

    unit: Unit
    ratio: float
    drawn: Drawn
    response: FrequencyResponse


def hide_other(name: str, cause: str, rng: np.random.Generator) -> Outside:
    """A reading of a unit by name that hides a cause of `CAUSES`."""
    unit = load_unit(name)
    machine, ratio = off_datasheet(unit, rng), float(rng.uniform(0.05, 0.95))
    drawn = CAUSES[cause].draw(unit, rng)
    hz = np.array(spaced_frequencies(*BANDS_HZ[name], POINTS))
    return Outside(unit, ratio, drawn, read(machine, ratio, drawn, hz, LEVELS_VPK, rng))


def read(
    unit: Unit,
    ratio: float,
    drawn: Drawn,
    hz: NDArray[np.float64],
    levels_vpk: tuple[float, ...],
    rng: np.random.Generator,
) -> FrequencyResponse:
    """What a bench reads of a machine with a cause, stepped by the oracle."""
    parameters = dict(unit.parameters)
    for symbol, factor in drawn.factors.items():
        parameters[symbol] *= factor
    assert unit.stage2 is not None
    plays = stage_backlash(ratio, unit.backlash.b_t_deg, unit.stage2.N).half_plays_rad
    points = len(hz)
    gains, errors = [], []
    for level, source_vpk in enumerate(levels_vpk):
        cycles = rk4.sweep(
            parameters, *plays, source_vpk, hz, SETTLE, INTEGRATE, extras=drawn.extras
        )[:, :, 1]
        gain = cycles.mean(axis=1)
        variance = np.sum(abs(cycles - gain[:, None]) ** 2, axis=1) / (INTEGRATE * (INTEGRATE - 1))
        if drawn.chain is not None:
            share = (level * points + np.arange(points)) / (len(levels_vpk) * points)
            factor = drawn.chain(hz, share)
            gain, variance = gain * factor, variance * abs(factor) ** 2
        noise = NOISE_V / source_vpk
        added = rng.standard_normal((2, points)) * noise
        gain = gain + added[0] + 1j * added[1]
        gains.append(gain)
        errors.append(DB_PER_NEPER * np.sqrt((variance + 2.0 * noise**2) / abs(gain) ** 2))
    return FrequencyResponse.from_arrays(
        np.tile(hz, len(levels_vpk)),
        np.repeat(levels_vpk, points),
        np.concatenate(gains),
        unit=unit.name,
        gain_std_db=np.concatenate(errors),
        direction="up",
        settle_cycles=SETTLE,
        integrate_cycles=INTEGRATE,
    )


def outcome(cause: str, hidden: Outside, found: Diagnosis) -> dict:
    """What is kept of one set."""
    verdict = found.verdict
    return {
        "unit": hidden.unit.name,
        "cause": cause,
        "size": hidden.drawn.size,
        "ratio": hidden.ratio,
        "verdict": verdict.word,
        "named": {c.effect: {s.name: (s.value, s.std) for s in c.sizes} for c in found.causes},
        "rivals": [list(one.effects) for one in verdict.rivals],
        "probability": verdict.probability,
        "found_ratio": found.ratio_extended,
        "held_out_sigma": found.held_out_sigma,
        "misfit": verdict.best.misfit,
        "structure": verdict.best.structure,
    }


def run(sets: int, seed: int, kept: Kept) -> None:
    """Diagnose the sets that are not kept yet; every cause in either unit takes its turn."""
    every = [(unit, cause) for unit in BANDS_HZ for cause in CAUSES]
    order = [every[i] for i in np.random.default_rng(seed).permutation(len(every))]
    for number in range(sets):
        if kept.has(seed, number):
            continue
        unit, cause = order[number % len(order)]
        hidden = hide_other(unit, cause, np.random.default_rng([seed, number]))
        used_s = time.process_time()
        found = diagnose_response(hidden.response, hidden.unit, cache=CACHE, seed=number)
        one = {"seed": seed, "number": number} | outcome(cause, hidden, found)
        kept.add(one | {"processor_s": time.process_time() - used_s})
        print(number, unit, cause, hidden.drawn.size, "->", _answer(one), flush=True)


def block(kept: Kept) -> list[str]:
    """The study as Markdown."""
    known = sorted(kept.outcomes, key=lambda one: (list(CAUSES).index(one["cause"]), one["unit"]))
    lines = [
        f"{len(known)} sets, seeds {kept.seeds}.",
        "",
        "| hidden | answer | levels not fitted missed by | ratio off, its error bar |",
        "| --- | --- | --- | --- |",
    ]
    for one in known:
        words = CAUSES[one["cause"]].words(one["size"])
        value, std = one["found_ratio"]
        lines.append(
            f"| {words}, {one['unit']} | {_answer(one)} | {one['held_out_sigma'][1]:.2f} | "
            f"{value - one['ratio']:+.3f}, {std:.3f} |"
        )
    return lines


def _answer(one: Mapping) -> str:
    named = " + ".join(_sized(one["unit"], *item) for item in one["named"].items())
    answer = one["verdict"] + (f": {named}" if named else "")
    rivals = [" + ".join(rival) or "nothing" for rival in one["rivals"]]
    return answer + (f", or {' or '.join(rivals)}" if rivals else "")


def _sized(unit: str, effect: str, sizes: Mapping[str, tuple[float, float]]) -> str:
    """An effect with how far a datasheet value is off, where it is one."""
    name, (value, _) = next(iter(sizes.items()))
    known = load_unit(unit.lower()).parameters.get(name)
    return effect if known is None else f"{effect} ({100 * (value / known - 1.0):+.0f} %)"


def main(sets: int = 30, seed: int | None = None, lines: str = "build/other-causes.jsonl") -> None:
    """Run the study and write its block."""
    seed, kept = drawn_seed(seed), Kept(lines)
    print(f"seed {seed}, {sets} sets", flush=True)
    run(sets, seed, kept)
    text = block(kept)
    replace_block("other-causes", text, PAGE)
    print("\n".join(text))


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:3]), *sys.argv[3:4])
