"""From the extrema of a believed model to anti-resonances, resonances and their pairs.

Owns which pair a level's ARF and RF are of, and the flags that say what else is in the band. It
fits nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from analysis.resonance.extrema import ExtremumGuess
from analysis.resonance.linear_model.reader import ModelReading, Read
from analysis.resonance.records import Feature, FeaturePair, LevelFeatures
from analysis.resonance.samples import Samples

__all__ = ["model_features"]

NOTABLE_SCATTER = 1.25
"""Residuals beyond this many stated errors are worth a flag."""
_VAGUE_DB, _VAGUE_DAMPING = 3.0, 1.0 / 3.0
"""Errors of gain and, as a share of it, of damping from which on noise may have made a feature."""
_SHARE = 0.5
"""The lowest pair that rises by this share of what the strongest one does is the level's."""


def model_features(
    source_vpk: float,
    reading: ModelReading,
    samples: Samples,
    candidates: tuple[ExtremumGuess, ExtremumGuess],
    flags: Sequence[str],
) -> LevelFeatures:
    """ARF, RF and all pairs of a level that one model describes.

    Parameters
    ----------
    candidates
        Valley and hill of the smoothed curve: why there is none, where the model has none.
    flags
        What else is known of the level.
    """
    made = [one for one in reading.found if one.made]
    pairs = _pairs(made)
    arf, rf = _leading(pairs)
    difference = std = None
    if arf is not None and rf is not None:
        difference = rf.feature.frequency_hz - arf.feature.frequency_hz
        i, j = reading.found.index(arf), reading.found.index(rf)
        c = reading.covariance
        std = math.sqrt(max(0.0, float(c[i, i] + c[j, j] - 2.0 * c[i, j])))
    said = [
        *_missing(arf, rf, reading, candidates),
        *(
            f"{name}: noise may have made it: its gain is known to {one.feature.gain_std_db:.2g} dB"
            for name, one in (("arf", arf), ("rf", rf))
            if one is not None and _is_vague(one)
        ),
        *flags,
        *_others(pairs, (arf, rf)),
        *(
            f"level: the reading at {hz:.6g} Hz is unlike its neighbours and was left out"
            for hz in reading.lonely_hz
        ),
    ]
    if samples.noise_known and reading.scatter > NOTABLE_SCATTER:
        said.append(f"level: scatter is {reading.scatter:.1f} times the stated errors")
    return LevelFeatures(
        source_vpk,
        _feature(arf),
        _feature(rf),
        difference,
        std,
        tuple(said),
        tuple(FeaturePair(_feature(low), _feature(high)) for low, high in pairs),
    )


_Pair = tuple[Read | None, Read | None]


def _feature(one: Read | None) -> Feature | None:
    return None if one is None else one.feature


def _pairs(made: Sequence[Read]) -> list[_Pair]:
    """Each minimum with the maximum next above it, ascending; either may be alone."""
    found: list[_Pair] = []
    waiting: Read | None = None
    for one in made:
        if one.sign < 0:
            if waiting is not None:
                found.append((waiting, None))
            waiting = one
        else:
            found.append((waiting, one))
            waiting = None
    if waiting is not None:
        found.append((waiting, None))
    return found


def _is_vague(one: Read) -> bool:
    """Whether neither its depth nor its damping is known, as of one that noise makes."""
    feature = one.feature
    if feature.gain_std_db < _VAGUE_DB:
        return False
    zeta, std = feature.damping_ratio, feature.damping_std
    return zeta is None or std is None or std > _VAGUE_DAMPING * zeta


def _leading(pairs: Sequence[_Pair]) -> _Pair:
    """The lowest whole pair that is not far weaker than the strongest; else what there is.

    What noise may have made comes last: it keeps no clear feature from being reported.
    """
    clear = [pair for pair in pairs if not all(_is_vague(one) for one in pair if one is not None)]
    pairs = clear or pairs
    whole = [(low, high) for low, high in pairs if low is not None and high is not None]
    if whole:
        rises = [high.feature.gain_db - low.feature.gain_db for low, high in whole]
        return next(
            pair for pair, rise in zip(whole, rises, strict=True) if rise >= _SHARE * max(rises)
        )
    alone = [low for low, _ in pairs if low is not None]
    if alone:
        return alone[0], None
    return (None, pairs[0][1]) if pairs else (None, None)


def _missing(
    arf: Read | None,
    rf: Read | None,
    reading: ModelReading,
    candidates: tuple[ExtremumGuess, ExtremumGuess],
) -> list[str]:
    """Why there is no ARF or no RF."""
    flags = []
    valley, hill = candidates
    if arf is None:
        vague = [one.feature for one in reading.found if one.sign < 0 and one.made]
        bare = [one.feature.frequency_hz for one in reading.found if one.sign < 0 and not one.made]
        if vague:
            # Of no leading pair.
            at = ", ".join(f"{one.frequency_hz:.6g}" for one in vague)
            flags.append(f"arf: noise may have made the minimum at {at} Hz")
        else:
            flags.append(f"arf: {_why(bare, valley, 'least', 'zeros', 'minimum')}")
    if rf is None:
        below = [
            one.feature.frequency_hz
            for one in reading.found
            if one.sign > 0 and one.made and arf is not None
        ]
        bare = [one.feature.frequency_hz for one in reading.found if one.sign > 0 and not one.made]
        if below and arf is not None:
            flags.append(
                f"rf: none above the anti-resonance; the resonance at {below[-1]:.6g} Hz lies below"
            )
        else:
            flags.append(f"rf: {_why(bare, hill, 'greatest', 'poles', 'maximum')}")
    return flags


def _why(bare: Sequence[float], candidate: ExtremumGuess, most: str, roots: str, name: str) -> str:
    if bare:
        at = ", ".join(f"{hz:.6g}" for hz in bare)
        return f"the gain has a {name} at {at} Hz, but no pair of {roots} makes it"
    if candidate.index is None:
        return candidate.reason
    return f"no pair of {roots} in the band makes the gain {most}"


def _others(pairs: Sequence[_Pair], taken: _Pair) -> list[str]:
    if len(pairs) < 2:
        return []
    told = "; ".join(
        "/".join("-" if one is None else f"{one.feature.frequency_hz:.6g}" for one in pair)
        for pair in pairs
    )
    number = next(k for k, pair in enumerate(pairs, start=1) if set(taken) & set(pair) - {None})
    return [
        f"level: {len(pairs)} pairs in the band, ARF/RF {told} Hz; arf and rf are of pair {number}"
    ]
