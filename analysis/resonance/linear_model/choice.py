"""How many zeros and poles a level shows: fits of rising order, pruned, weighed by a criterion.

Owns the orders that are tried, the criterion by which they are compared, and the search
for single readings that stand for nothing. It reads no feature and judges no fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.resonance.linear_model.fitting import Fit, Readings, fit_sections
from analysis.resonance.linear_model.sections import Complex, Section
from analysis.resonance.linear_model.vector_fitting import start_poles, vector_fit

__all__ = ["Choice", "choose"]

_ORDERS = (2, 3, 4, 5, 6, 7, 8, 10, 12)
"""Numbers of poles that are tried."""
_PLAIN = (1, 0)
"""And these where few are best."""
_READINGS_PER_PARAMETER = 3
_PATIENCE = 2
"""Orders without a better criterion after which higher ones are left."""
_REACH = 4.0
"""Zeros and poles further outside the band than this factor belong to the surrounding."""
_SIMILAR = 10.0
"""Fits whose criterion is within this of the least have a say in the errors."""
_LONELY = 0.75
"""A reading that has this share in its own fit may be the only one behind a section."""
_MOST_LONELY = 3
"""Readings that may be left out."""
_FOUND = 2.0
"""A fit that misses by more is none yet after which higher orders are left."""
_HOPELESS = 30.0
_SMALL_DB = 0.5
"""Residuals below this may be believed whatever the stated errors are."""
_BROAD = 0.4
"""Damping ratio from which on a pair may be given up for a plainer model."""
_LOW_PASS = (1.2, 0.8)
"""Start values of a low-pass: its corner over the upper end of the band, and damping ratio."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The fit that is chosen, and those that are nearly as good.

    Parameters
    ----------
    best
        The fit with the least criterion.
    rivals
        Other fits and the weight of each; the best one has 1.
    lonely
        Indices of readings that were left out: nothing near them shows what they do.
    """

    best: Fit
    rivals: tuple[tuple[Fit, float], ...]
    lonely: tuple[int, ...]


def choose(readings: Readings, most_scatter: float) -> Choice | None:
    """The fit that predicts best, by the criterion; None where nothing can be fitted.

    Parameters
    ----------
    most_scatter
        A fit whose residuals exceed their errors by more is believed by nobody, unless they are
        small: it is not made plainer.
    """
    kept = np.arange(len(readings.x))
    lonely: list[int] = []
    while True:
        fits = _fits(readings)
        if not fits:
            return None
        scale = max(1.0, min(fit.scale for fit in fits))
        best = min(fits, key=lambda fit: fit.criterion(scale))
        if best.scale > most_scatter and best.off_db > _SMALL_DB:
            break
        best = _pruned(best, scale)
        alone = _lonely_reading(best, scale) if len(lonely) < _MOST_LONELY else None
        if alone is None:
            break
        lonely.append(int(kept[alone]))
        kept = np.delete(kept, alone)
        readings = readings.without(np.array([alone]))
    least = best.criterion(scale)
    rivals = tuple(
        (fit, float(np.exp(-0.5 * max(0.0, fit.criterion(scale) - least))))
        for fit in fits
        if fit.criterion(scale) < least + _SIMILAR
    )
    return Choice(best, rivals, tuple(lonely))


def _fits(readings: Readings) -> list[Fit]:
    """Fits of rising order, as long as they get better."""
    most = (readings.count / _READINGS_PER_PARAMETER - 4) / 2
    fits: list[Fit] = []
    for order in _ORDERS:
        if order > most or (order > 8 and (fits and fits[-1].scale > _HOPELESS)):
            break
        fit = _fit(readings, order)
        if fit is None:
            continue
        fits.append(fit)
        scale = max(1.0, min(one.scale for one in fits))
        best = int(np.argmin([one.criterion(scale) for one in fits]))
        found = fits[best].scale < _FOUND or fits[best].off_db < _SMALL_DB
        if found and len(fits) - 1 - best >= _PATIENCE:
            break
    if len(fits) <= _PATIENCE + 2:
        fits += [fit for order in _PLAIN if (fit := _fit(readings, order)) is not None]
    return fits


def _fit(readings: Readings, order: int) -> Fit | None:
    x, gain = readings.x, readings.gain
    if order == 0:
        return fit_sections(readings, ())
    sigma = readings.along if readings.absolute else readings.along * np.abs(gain)
    found = vector_fit(x, gain, 1.0 / sigma, start_poles(x[0], x[-1], order))
    if found is None:
        return None
    return fit_sections(readings, _sections(*found, float(x[0]), float(x[-1])))


def _sections(poles: Complex, zeros: Complex, low: float, high: float) -> tuple[Section, ...]:
    found = []
    for roots, kind in ((zeros, 1), (poles, -1)):
        for root in roots:
            w = float(abs(root))
            if root.imag < 0.0 or not low / _REACH < w < high * _REACH:
                continue
            side = -1 if kind > 0 and root.real > 0.0 else 1
            zeta = max(abs(float(root.real)) / w, 1e-4) if root.imag > 0.0 else None
            found.append(Section(w, zeta, kind, side))
    return tuple(sorted(found, key=lambda section: section.w))


def _pruned(fit: Fit, scale: float) -> Fit:
    """The fit without sections that the readings do not ask for."""
    while True:
        best = fit
        for plainer in _plainer(fit):
            less = fit_sections(fit.readings, plainer, iterations=12)
            if less is not None and less.criterion(scale) < best.criterion(scale):
                best = less
        if best is fit:
            return fit
        fit = best


def _plainer(fit: Fit) -> list[tuple[Section, ...]]:
    """Fewer sections that may do: without some, or with one low-pass for all that are broad."""
    found = [
        tuple(s for k, s in enumerate(fit.sections) if k not in gone)
        for gone in _dispensable(fit.sections)
    ]
    low, high = fit.readings.x[[0, -1]]
    narrow = tuple(
        s for s in fit.sections
        if s.zeta is not None and s.zeta < _BROAD and low < s.w < high
    )  # fmt: skip
    if sum(s.size for s in fit.sections) > sum(s.size for s in narrow) + 2:
        found.append((*narrow, Section(_LOW_PASS[0] * float(high), _LOW_PASS[1], -1)))
    return found


def _dispensable(sections: tuple[Section, ...]) -> list[tuple[int, ...]]:
    """Sections that may be there for nothing: broad ones, and a zero on top of a pole."""
    found: list[tuple[int, ...]] = []
    for k, section in enumerate(sections):
        if section.zeta is None or section.zeta > _BROAD:
            found.append((k,))
        for j, other in enumerate(sections[:k]):
            apart = abs(np.log(section.w / other.w))
            width = max(section.zeta or 1.0, other.zeta or 1.0)
            if other.kind != section.kind and other.size == section.size and apart < width:
                found.append((j, k))
    return found


def _lonely_reading(fit: Fit, scale: float) -> int | None:
    """A reading without which the sections next to it are not asked for, or None."""
    x = fit.readings.x
    for k in np.argsort(-fit.leverage)[:_MOST_LONELY]:
        if not fit.leverage[k] > _LONELY or k in (0, len(x) - 1):
            continue
        reach = x[k + 1] - x[k - 1]
        near = tuple(
            j
            for j, s in enumerate(fit.sections)
            if s.zeta is not None and abs(s.w - x[k]) < reach and s.zeta * s.w < 0.5 * reach
        )
        if not near:
            continue
        rest = tuple(s for j, s in enumerate(fit.sections) if j not in near)
        others = fit.readings.without(np.array([k]))
        without = fit_sections(others, rest)
        with_it = fit_sections(others, fit.sections)
        if without is None:
            continue
        if with_it is None or without.criterion(scale) < with_it.criterion(scale):
            return int(k)
    return None
