"""The response of a drive without backlash, friction as its describing function.

Owns an approximate response within milliseconds, for sensitivities to datasheet values. It
simulates no motion and is no measure of fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.effects import drivetrain_with
from sim.engine.linear import parts_at
from sim.engine.system import Law, Nonlinearity
from sim.unit import Unit

__all__ = ["linear_response"]

_DAMPED = 0.06
"""Damping added to every mode: play rounds off a resonance that a linear model has sharp."""

_ROUNDS = 3
"""Of the describing function of friction: speed decides damping, damping decides speed."""


def linear_response(
    unit: Unit, frequency_hz: NDArray[np.float64], levels_vpk: Sequence[float]
) -> NDArray[np.complex128]:
    """Response (levels x frequencies,) with every mesh closed.

    The describing function of a friction T at a speed of amplitude w is a damper 4 T / (pi w):
    A. Gelb and W. E. Vander Velde, "Multiple-Input Describing Functions and Nonlinear System
    Design", 1968, ch. 2. That of one which a mesh loads is its first harmonic in the same way.
    """
    system = drivetrain_with(unit, 0.5 if unit.stages > 1 else 1.0).system()
    frictions = [law for law in system.nonlinearities if law.law in (Law.FRICTION, Law.LOADED)]
    s = 2.0 * np.pi * frequency_hz * (1j + _DAMPED)
    A, b, o, chain = parts_at(system, s)
    plain = s[:, None, None] * np.eye(b.shape[-1]) - A
    found = []
    for level_vpk in levels_vpk:
        state = np.linalg.solve(plain, b[..., None].astype(complex))[..., 0]
        for _ in range(_ROUNDS):
            held = plain.copy()
            for law in frictions:
                speed = np.maximum(level_vpk * np.abs(state @ law.outlet), 1e-12)
                damper = np.asarray(4.0 * law.parameters[0] / (np.pi * speed))
                if law.law is Law.LOADED:
                    mesh = system.nonlinearities[law.loaded_by]
                    damper += law.parameters[1] * _loaded(state, law, mesh)
                held += damper[:, None, None] * np.outer(law.inlet, law.outlet)
            state = np.linalg.solve(held, b[..., None].astype(complex))[..., 0]
        seen = state @ o if o.ndim == 1 else np.einsum("fn,fn->f", state, o)
        found.append(seen * chain)
    return np.concatenate(found)


def _loaded(state: NDArray[Any], law: Nonlinearity, mesh: Nonlinearity) -> NDArray[np.float64]:
    """First harmonic of abs(F) sign(w) over that of w (frequencies,), F what a mesh transmits.

    With an angle p between F and w it is (2/pi) ((pi/2 - p) cos p + sin p) times F/w, 0 <= p <= pi.
    """
    torque, speed = mesh.stiffness * (state @ mesh.outlet), state @ law.outlet
    angle = np.abs(np.angle(torque / np.where(speed == 0.0, 1.0, speed)))
    share = (2.0 / np.pi) * ((0.5 * np.pi - angle) * np.cos(angle) + np.sin(angle))
    return np.asarray(share * np.abs(torque) / np.maximum(np.abs(speed), 1e-12))
