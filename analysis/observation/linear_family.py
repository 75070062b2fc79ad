"""What linear machines near a unit would show: a wide family, in closed form.

Owns the transfer function of the paper's chain with every parameter free, thousands of machines at
once. Play softens a mesh and friction damps, so that at one level a machine with both shows about
what some linear one does. It is good for telling what cannot be this unit at all, and for no
number. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.drivetrain import paper_drivetrain
from sim.engine.linear import chain_factor
from sim.engine.nonlinearity import held
from sim.unit import Unit

__all__ = ["AT_REST", "Family", "draw_machines", "neighbours"]

Vector = NDArray[np.float64]

_RANGES: Mapping[str, tuple[float, float]] = {
    # Factors on datasheet values. Play softens the train by up to a factor of some tens.
    "softness": (0.03, 1.5),
    "inertia": (0.45, 2.2),
    "resistance": (0.5, 2.0),
    "constant": (0.5, 2.0),
    "corner": (0.5, 2.0),
    # Friction and dampers as dampers: on the motor over its B_m, on the load over the critical
    # damping of the load on its shaft, in the train over the same.
    "motor_loss": (0.3, 300.0),
    "load_loss": (1e-3, 3.0),
    "train_loss": (1e-3, 1.0),
    # A spring to ground over the stiffness of the shaft; a first-order lag, s.
    "cable": (1e-3, 2.0),
    "lag": (1e-6, 5e-3),
    # Something on the load with its own spring: share of its inertia, and frequency over that of
    # the load on its shaft.
    "payload": (1e-3, 0.5),
    "payload_at": (0.3, 30.0),
    "payload_loss": (0.005, 0.1),
}


_NEUTRAL = {
    "motor_loss": 1.0,
    "load_loss": 1e-3,
    "train_loss": 1e-3,
    "cable": 1e-3,
    "lag": 1e-6,
    "payload": 1e-3,
    "payload_loss": 0.05,
}
"""What does next to nothing; 1 where it is not named."""

_ALWAYS = ("softness", "motor_loss", "load_loss", "train_loss")
"""What play and friction do at any machine; of the rest none, one or two at a time."""

_CAUSES = (
    ("inertia",),
    ("resistance",),
    ("constant",),
    ("corner",),
    ("cable",),
    ("lag",),
    ("payload", "payload_at", "payload_loss"),
)

_ENDS = np.log(np.array(list(_RANGES.values())))
AT_REST = np.log(np.array([_NEUTRAL.get(name, 1.0) for name in _RANGES]))
"""Logarithms (parameters,) of the datasheet's machine, hardly damped."""


def draw_machines(count: int, rng: np.random.Generator) -> tuple[Vector, NDArray[np.bool_]]:
    """Logarithms (machines, parameters) of machines, and which of them are not as at rest."""
    names = list(_RANGES)
    free = np.zeros((count, len(names)), dtype=bool)
    free[:, [names.index(name) for name in _ALWAYS]] = True
    causes = rng.permuted(np.tile(np.arange(len(_CAUSES)), (count, 1)), axis=1)
    several = rng.choice([0, 1, 1, 2], count)
    for place in range(2):
        for cause, parts in enumerate(_CAUSES):
            having = (causes[:, place] == cause) & (several > place)
            for part in parts:
                free[having, names.index(part)] = True
    drawn = rng.uniform(_ENDS[:, 0], _ENDS[:, 1], free.shape)
    return np.where(free, drawn, AT_REST), free


def neighbours(
    logs: Vector, free: NDArray[np.bool_], share: float, count: int, rng: np.random.Generator
) -> tuple[Vector, NDArray[np.bool_]]:
    """Machines near some, moved by about a share of every range in half of what is free."""
    of = rng.integers(len(logs), size=count)
    moved = free[of] & (rng.random((count, logs.shape[1])) < 0.5)
    steps = rng.normal(size=moved.shape) * share * np.ptp(_ENDS, axis=1)
    low, high = np.minimum(_ENDS[:, 0], AT_REST), np.maximum(_ENDS[:, 1], AT_REST)
    return np.clip(logs[of] + steps * moved, low, high), free[of]


@dataclass(frozen=True, slots=True)
class Family:
    """Linear machines about a unit."""

    unit: Unit

    def responses(self, logs: Vector, frequency_hz: Vector) -> NDArray[np.complex128]:
        """Logarithms (machines, frequencies) of V_o/V_i.

        Parameters
        ----------
        logs
            Logarithms (machines, parameters), as `draw_machines` gives them.
        """
        p = dict(zip(_RANGES, np.exp(logs).T[:, :, None], strict=True))
        s = np.asarray(2j * np.pi * frequency_hz[None, :], dtype=np.complex128)
        motor, electronics = self.unit.motor, self.unit.electronics
        felt = self._train(p, s) / self.unit.stage1.N_1**2
        if (coupling := self.unit.motor_coupling) is not None:
            felt = _behind(coupling.k_cm + coupling.c_cm * s, felt + coupling.J_cm * s, s)
        mechanical = motor.J_m * s + motor.B_m * p["motor_loss"] + felt
        k_t, k_b = motor.k_t * p["constant"], (motor.k_b or 0.0) * p["constant"]
        electrical = (motor.R_m or 1.0) * p["resistance"] + (motor.L_a or 0.0) * s
        if (current := self.unit.amplifier) is not None:
            electrical = p["resistance"] + s / (2.0 * np.pi * current.bandwidth_hz)
        speed = electronics.k_a * k_t / (electrical * mechanical + k_t * k_b)
        if (sensor := self.unit.sensor) is not None and sensor.kind == "current":
            speed = speed * mechanical / k_t
        read = electronics.k_ts * speed
        numerator, denominator = electronics.filter_numerator, electronics.filter_denominator
        filtered = np.ones_like(s)
        if numerator is not None and denominator is not None:
            d2, d1, d0 = denominator
            corner = p["corner"]
            filtered = numerator * corner**2 / (d2 * s**2 + d1 * corner * s + d0 * corner**2)
        shown = read / (1.0 + s * p["lag"]) * filtered * self._closing(s, read, filtered)
        return np.asarray(np.log(shown) + np.log(self._read(s)))

    def _closing(
        self, s: NDArray[np.complex128], read: NDArray[np.complex128], filtered: Any
    ) -> NDArray[np.complex128]:
        """What a loop makes of a response: by how much it is larger than without one."""
        loop, clock = self.unit.loop, self.unit.sampling
        if loop is None:
            return np.ones_like(s)
        integral = 0.0 if loop.T_i_s is None else 1.0 / (loop.T_i_s * s)
        control: Any = loop.K_p * (1.0 + integral)
        control = control * np.exp(-s * (loop.computing_s or 0.0))
        around = control * read * (filtered if loop.filtered else 1.0)
        if clock is not None and clock.holds_command:
            around = around * held(s / clock.rate_hz)
        if loop.K_v is not None:
            # It hears the position, the integral of the speed, besides.
            control, around = loop.K_v * control, around * (1.0 + loop.K_v / s)
        return np.asarray((control if loop.excited == "reference" else 1.0) / (1.0 + around))

    def _read(self, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """What a clock, another sensor than a tachometer and a stated delay do."""
        if self.unit.sampling is None and self.unit.sensor is None:
            return np.ones_like(s)
        # What a controller holds is in its loop, not behind it.
        plain = self.unit.model_copy(update={"loop": None})
        read = chain_factor(paper_drivetrain(plain, 1.0).system(), s)
        if (sensor := self.unit.sensor) is None:
            return read
        derived = {"position": 1.0 / s, "acceleration": s * (sensor.radius_m or 1.0)}
        read = read * derived.get(sensor.reads, 1.0)
        if sensor.low_pass_hz is not None:
            read = read / (1.0 + s / (2.0 * np.pi * sensor.low_pass_hz))
        if sensor.high_pass_hz is not None:
            read = read * s / (s + 2.0 * np.pi * sensor.high_pass_hz)
        return read

    def _train(self, p: Mapping[str, Vector], s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Torque over speed (machines, frequencies) at gear 1."""
        stage1, load = self.unit.stage1, self.unit.load
        ratio = self.unit.output_ratio
        shaft = stage1.k_s1 * p["softness"]
        at_load = stage1.k_s1 * ratio**2
        critical = 2.0 * np.sqrt(at_load * load.J_L)
        own = np.sqrt(at_load / load.J_L)
        omega = own * p["payload_at"]
        force = omega**2 + 2.0 * p["payload_loss"] * omega * s
        swinging = p["payload"] * load.J_L * force / (force + s**2)
        felt = (load.J_L * p["inertia"] + swinging) * s
        felt = felt + critical * p["load_loss"] + at_load * p["cable"] / s
        if (coupling := self.unit.load_coupling) is not None:
            felt = _behind(coupling.k_cL + coupling.c_cL * s, felt, s) + coupling.J_cL * s
        if (stage3 := self.unit.stage3) is not None:
            felt = _behind(stage3.k_3 + 0.0 * s, felt, s) / stage3.N_3**2 + stage3.J_g2 * s
        if self.unit.stage2 is not None:
            felt = _behind(self.unit.stage2.k_2 + 0.0 * s, felt, s) / self.unit.stage2.N**2
            felt = felt + (stage1.J_p2 or 0.0) * s
        spring = shaft + critical / ratio**2 * p["train_loss"] * s
        felt = _behind(2.0 * spring, felt, s) + stage1.J_s1 * s
        felt = _behind(2.0 * spring, felt, s) + stage1.J_g1 * s
        return _behind(stage1.k_g1 + 0.0 * s, felt, s)


def _behind(
    stiffness: NDArray[np.complex128], felt: NDArray[np.complex128], s: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """What is felt through a spring, or a spring and a damper."""
    # One division: they take most of the time.
    return np.asarray(stiffness * felt / (s * felt + stiffness))
