"""Servos to simulate: a machine's system, its laws' parameters, and where its motion starts.

Owns the start: at rest, each mesh somewhere inside its play. It steps nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.effects import EffectSetting, drivetrain_with
from sim.engine.layout import HELD
from sim.engine.system import Law, PiecewiseLinearSystem
from sim.unit import Unit

__all__ = [
    "START_SPREAD",
    "Servo",
    "groups_alike",
    "linear_key",
    "parameters_of",
    "states_at_start",
]

_LANES_PER_LOT = 64

START_SPREAD = 0.02
"""How far from the middle of its play a mesh starts at most, as a share of the half play.

At low drive the motion keeps to the branch that it starts on; one that starts
near the middle behaves as the paper's simulation from rest does.
"""


@dataclass(frozen=True, slots=True)
class Servo:
    """One machine to simulate: a system and where its motion starts.

    `seed` draws the start: every mesh rests somewhere inside its play, at most
    `start_spread` of the way from its middle to either end. Servos
    that share their linear part are stepped side by side, so vary play,
    friction and seed freely: they cost least.
    """

    system: PiecewiseLinearSystem
    seed: int = 0
    start_spread: float = START_SPREAD

    @classmethod
    def of(
        cls,
        unit: Unit,
        ratio: float,
        effects: Sequence[EffectSetting] = (),
        seed: int = 0,
        start_spread: float = START_SPREAD,
    ) -> Servo:
        """The servo of a unit at one contribution ratio with some effects."""
        return cls(drivetrain_with(unit, ratio, effects).system(), seed, start_spread)


def states_at_start(servos: Sequence[Servo], levels: int) -> NDArray[np.float64]:
    """States (n, servos x levels) at rest, each mesh somewhere inside its play.

    Of a system with a clock there are five more rows for each sampled law
    (`sim.engine.layout.HELD`): the seed draws when the clock ticks, and where an encoder stands.
    """
    system = servos[0].system
    meshes = [law for law in system.nonlinearities if law.law is Law.PLAY]
    columns = []
    for servo in servos:
        halves = [law.parameters[0] for law in servo.system.nonlinearities if law.law is Law.PLAY]
        rng = np.random.default_rng(servo.seed)
        where = rng.uniform(-1.0, 1.0, size=(levels, len(halves))) * halves * servo.start_spread
        # The smallest angles that put each mesh there leave every spring but
        # the meshes unwound only if they are compliant; springs are excluded
        # by solving for the meshes' deflections and zero elastic energy elsewhere.
        still = _at_rest(system, meshes, where)
        columns.append(np.concatenate([still, _held(servo.system, still, rng)]))
    return np.concatenate(columns, axis=1)


def _at_rest(
    system: PiecewiseLinearSystem, meshes: Sequence, where: NDArray[np.float64]
) -> NDArray[np.float64]:
    n = len(system.b)
    if not meshes:
        return np.zeros((n, len(where)))
    outlets = np.array([mesh.outlet for mesh in meshes])
    # What stores energy besides the meshes: rows that must stay zero.
    elastic = system.energy - sum(
        mesh.stiffness * np.outer(mesh.outlet, mesh.outlet) for mesh in meshes
    )
    rows = np.vstack([outlets, elastic / max(np.abs(elastic).max(), 1e-300)])
    wanted = np.vstack([where.T, np.zeros((n, len(where)))])
    return np.asarray(np.linalg.lstsq(rows, wanted, rcond=None)[0], dtype=float)


def _held(
    system: PiecewiseLinearSystem, still: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.float64]:
    """What sampled laws hold at the start (5 per law, levels)."""
    held = np.zeros((HELD * len(system.sampled), still.shape[1]))
    phase = rng.random(still.shape[1]) if system.sampled else 0.0
    offsets: dict[bytes, Any] = {}
    for i, law in enumerate(system.sampled):
        held[HELD * i] = phase
        if law.law is not Law.HOLD:
            # Laws that count the same shaft are one encoder.
            shaft = law.outlet.tobytes()
            offset = offsets[shaft] if shaft in offsets else rng.random(still.shape[1])
            offsets[shaft] = offset
            held[HELD * i + 1] = offset
            held[HELD * i + 2] = np.floor(law.outlet @ still / law.parameters[1] + offset)
    return held


def parameters_of(servos: Sequence[Servo], levels: int) -> NDArray[np.float64]:
    """Law parameters (m, 3, servos x levels)."""
    per_servo = [
        np.array([law.parameters for law in servo.system.nonlinearities]).reshape(-1, 3)
        for servo in servos
    ]
    return np.repeat(np.stack(per_servo, axis=-1), levels, axis=-1)


def groups_alike(servos: Sequence[Servo], levels: int, workers: int) -> Iterable[list[int]]:
    """Indices of servos that share their linear part, in lots that fill lanes and cores."""
    alike: dict[bytes, list[int]] = {}
    for index, servo in enumerate(servos):
        alike.setdefault(linear_key(servo.system), []).append(index)
    for members in alike.values():
        share = -(-len(members) // workers) if len(alike) < workers else len(members)
        size = max(min(share, _LANES_PER_LOT // levels), 1)
        for start in range(0, len(members), size):
            yield members[start : start + size]


def linear_key(system: PiecewiseLinearSystem) -> bytes:
    """What systems have in common that are stepped side by side, as bytes."""
    reading = np.array([system.reading.delay_s, system.reading.sample_s])
    parts = [system.A, system.b, system.f, system.o, reading]
    for law in system.nonlinearities:
        stribeck = float(law.law is Law.FRICTION and law.parameters[1] != 0.0)
        fixed = np.array([law.law, law.feedthrough, law.stiffness, law.damping, stribeck, law.read])
        parts += [law.inlet, law.outlet, fixed, np.array(law.hears).ravel()]
        if law.law is Law.LOADED:
            parts.append(np.array(law.loaded_by))
    return b"".join(np.ascontiguousarray(part, dtype=float).tobytes() for part in parts)
