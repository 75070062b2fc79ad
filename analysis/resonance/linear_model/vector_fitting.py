"""Poles and zeros of a response by vector fitting, as start values for a fit by least squares.

Owns the relaxed iteration of Gustavsen and Semlyen (IEEE Trans. Power Delivery 14 (1999) 1052;
21 (2006) 1587) on one response. It states no errors and judges nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.resonance.linear_model.sections import Complex
from analysis.resonance.neighbour_noise import Vector

__all__ = ["start_poles", "vector_fit"]

_START_LOSS = 0.05
"""Damping ratio of start poles."""


def start_poles(low: float, high: float, order: int) -> Complex:
    """Lightly damped pairs over a band, and one real pole where the order is odd."""
    pairs = order // 2
    at = np.exp(np.linspace(np.log(low), np.log(high), pairs + 2)[1:-1])
    poles = np.concatenate([at * (-_START_LOSS + 1j), at * (-_START_LOSS - 1j)])
    real = [-np.sqrt(low * high) + 0j] if order % 2 else []
    return np.concatenate([poles, np.asarray(real, dtype=complex)])


def vector_fit(
    x: Vector, gain: Complex, weight: Vector, poles: Complex, *, iterations: int = 6
) -> tuple[Complex, Complex] | None:
    """Poles and zeros of the rational function that is nearest to a response.

    Parameters
    ----------
    x
        Frequencies, shape (points,); s = i x.
    gain, weight
        The response, and one over the standard error of each component.
    poles
        Start poles, closed under conjugation.
    iterations
        Relocations of the poles.

    Returns
    -------
    Poles and zeros, or None where the arithmetic fails.
    """
    for _ in range(iterations):
        moved = _relocated(x, gain, weight, poles)
        if moved is None:
            return None
        poles = moved
    basis, a, b = _basis(x, poles)
    system = np.concatenate([basis, np.ones((x.size, 1))], axis=1) * weight[:, None]
    solved = _solve(_real(system), _real((gain * weight)[:, None])[:, 0])
    if solved is None:
        return None
    zeros = _roots(a, b, solved[:-1], solved[-1])
    return None if zeros is None else (poles, zeros)


def _relocated(x: Vector, gain: Complex, weight: Vector, poles: Complex) -> Complex | None:
    basis, a, b = _basis(x, poles)
    order = len(poles)
    numerator = np.concatenate([basis, np.ones((x.size, 1))], axis=1) * weight[:, None]
    sigma = numerator * -gain[:, None]
    rows = _real(np.concatenate([numerator, sigma], axis=1))
    # Relaxation: the mean of sigma's real part is 1, in place of its constant.
    total = np.concatenate([np.zeros(order + 1), basis.sum(axis=0).real, [float(x.size)]]) * (
        np.linalg.norm(weight * np.abs(gain)) / x.size
    )
    rows = np.concatenate([rows, total[None, :]])
    right = np.zeros(len(rows))
    right[-1] = np.linalg.norm(weight * np.abs(gain))
    solved = _solve(rows, right)
    if solved is None:
        return None
    moved = _roots(a, b, solved[order + 1 : -1], solved[-1])
    if moved is None or not np.all(np.isfinite(moved)):
        return None
    # What is measured is stable.
    return np.asarray(-np.abs(moved.real) + 1j * moved.imag, dtype=complex)


def _real(rows: NDArray[Any]) -> Vector:
    return np.concatenate([np.real(rows), np.imag(rows)])


def _solve(rows: NDArray[Any], right: Vector) -> Vector | None:
    scale = np.linalg.norm(rows, axis=0)
    if not np.all(np.isfinite(scale)) or np.any(scale <= 0.0) or not np.all(np.isfinite(right)):
        return None
    try:
        return np.asarray(np.linalg.lstsq(rows / scale, right, rcond=None)[0] / scale)
    except np.linalg.LinAlgError:
        return None


def _basis(x: Vector, poles: Complex) -> tuple[Complex, Vector, Vector]:
    """Partial fractions with real coefficients, and their state space: A and B."""
    s = 1j * x
    order = len(poles)
    columns, a, b = [], np.zeros((order, order)), np.zeros(order)
    at = 0
    for pole in poles:
        if pole.imag > 0.0:
            left, right = 1.0 / (s - pole), 1.0 / (s - np.conj(pole))
            columns += [left + right, 1j * left - 1j * right]
            a[at : at + 2, at : at + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
            b[at] = 2.0
            at += 2
        elif pole.imag == 0.0:
            columns.append(1.0 / (s - pole))
            a[at, at], b[at] = pole.real, 1.0
            at += 1
    return np.stack(columns, axis=1), a, b


def _roots(a: Vector, b: Vector, c: Vector, d: float) -> Complex | None:
    """Zeros of c (s - A)^-1 b + d."""
    if not np.isfinite(d) or abs(d) < 1e-12 * (np.linalg.norm(c) + 1e-300):
        d = 1e-12 * float(np.linalg.norm(c) + 1e-300)
    matrix = a - np.outer(b, c) / d
    if not np.all(np.isfinite(matrix)):
        return None
    roots: NDArray[np.complex128] = np.linalg.eigvals(matrix).astype(complex)
    # Conjugates to the last bit.
    pairs = roots[roots.imag > 0.0]
    return np.concatenate([pairs, np.conj(pairs), roots[roots.imag == 0.0]])
