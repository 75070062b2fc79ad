"""A response as a product of first- and second-order sections over a slowly varying surrounding.

Owns the model and its derivatives, in the complex plane and as a logarithm. It fits nothing and
knows no readings.

With x = f / f_0 the model is

    ln G = sum_zeros D(x) - sum_poles D(x) + a_0 + a_1 ln x + i (b_0 + b_1 (x - 1))
    D(x) = ln(1 + 2 i zeta (x/w) - (x/w)^2)    a pair
    D(x) = ln(1 + i x/w)                       a single real zero or pole

a_0 to b_1 carry gain, integrators, sign and delay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.resonance.neighbour_noise import Vector

__all__ = ["SURROUNDING", "Section", "evaluate", "pack", "positions", "unpack"]

Complex = NDArray[np.complex128]

SURROUNDING = 4
"""Parameters of the surrounding: a_0, a_1, b_0, b_1; the last two turn the phase only."""


@dataclass(frozen=True, slots=True)
class Section:
    """A pair of zeros or poles, or a single real one.

    Parameters
    ----------
    w
        Undamped natural frequency or corner over f_0.
    zeta
        Damping ratio of a pair, above 1 for two real ones; None for a single one.
    kind
        ``+1`` for zeros, ``-1`` for poles.
    side
        ``+1`` for the left half plane, ``-1`` for the right (zeros only).
    """

    w: float
    zeta: float | None
    kind: int
    side: int = 1

    @property
    def size(self) -> int:
        """Number of parameters."""
        return 1 if self.zeta is None else 2


def positions(sections: tuple[Section, ...]) -> list[int]:
    """Where the parameters of each section begin, and where the surrounding does."""
    starts = [0]
    for section in sections:
        starts.append(starts[-1] + section.size)
    return starts


def pack(sections: tuple[Section, ...]) -> Vector:
    """Parameters ln w and ln zeta of all sections, then a surrounding of 0."""
    values: list[float] = []
    for section in sections:
        values.append(np.log(section.w))
        if section.zeta is not None:
            values.append(np.log(section.zeta))
    return np.array(values + [0.0] * SURROUNDING)


def unpack(theta: Vector, sections: tuple[Section, ...]) -> tuple[Section, ...]:
    """Sections with the values of the parameters."""
    found = []
    for at, section in zip(positions(sections), sections, strict=False):
        zeta = None if section.zeta is None else float(np.exp(theta[at + 1]))
        found.append(Section(float(np.exp(theta[at])), zeta, section.kind, section.side))
    return tuple(found)


def evaluate(x: Vector, theta: Vector, sections: tuple[Section, ...]) -> tuple[Complex, Complex]:
    """Logarithm of G, shape (points,), and its derivative, shape (points, parameters).

    The imaginary part of the logarithm may be off by whole turns.
    """
    jacobian: Complex = np.empty((x.size, theta.size), dtype=complex)
    value: Complex = np.zeros(x.size, dtype=complex)
    starts = positions(sections)
    for at, section in zip(starts, sections, strict=False):
        q = x / np.exp(theta[at])
        if section.zeta is None:
            loss = 1j * section.side * q
            d = 1.0 + loss
            jacobian[:, at] = -section.kind * loss / d
        else:
            loss = 2j * section.side * np.exp(theta[at + 1]) * q
            d = 1.0 - q * q + loss
            jacobian[:, at] = section.kind * (2.0 * q * q - loss) / d
            jacobian[:, at + 1] = section.kind * loss / d
        value += section.kind * np.log(d)
    first = starts[-1]
    jacobian[:, first] = 1.0
    jacobian[:, first + 1] = np.log(x)
    jacobian[:, first + 2] = 1j
    jacobian[:, first + 3] = 1j * (x - 1.0)
    value += jacobian[:, first:] @ theta[first:]
    return value, jacobian
