"""What the error column of a response is: cycle-to-cycle scatter, or an error bar and no more.

Owns the decision whether `gain_std_db` may be compared with the scatter of simulated motion, and
the words that say which was taken. Only a response that declares scatter is taken for it. It
computes no channel and changes no response.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.resonance.neighbour_noise import neighbour_residual
from analysis.resonance.samples import refuse_levels
from daq.errors import InputError
from daq.frf import (
    DB_PER_NEPER,
    GAIN_STD_COMPONENTS,
    GAIN_STD_IS,
    FrequencyResponse,
    error_words,
)

__all__ = ["StatedError", "error_doubts", "error_notes", "stated_error"]

_SCATTER = re.compile(
    r"cycle-to-cycle scatter( along the gain| of both components)?, "
    r"standard error of the mean over ([0-9]{1,9}) cycles\Z"
)

_JUDGED = 20
"""Rows from which on a column that is not declared in words is held against its neighbours."""

_LEAST_CORRELATION = 0.25
"""Rank correlation of stated errors with the readings' own scatter. Twelve sets of another
program have 0.54 to 0.75; a column that has nothing to do with the readings has 0 +- 0.07."""

_WITHIN = 5.0
"""Factor between stated errors and the readings' own scatter that scatter may have. The same sets
have 0.7 to 2.0, as neighbouring cycles of a chattering motion are not independent."""


@dataclass(frozen=True, slots=True)
class StatedError:
    """What an error column is taken for.

    `components`: over how many components of the reading it counts the scatter of the motion;
    None where it is no scatter. `cycles`: of how many cycles, None where that is not said in
    words. `doubt`: why it is not taken for scatter, empty where it is. `note`: what it is taken
    for where nothing says so in words.
    """

    components: int | None
    cycles: int | None
    doubt: str = ""
    note: str = ""


def stated_error(response: FrequencyResponse) -> StatedError:
    """Decide what `gain_std_db` of a response is.

    Raises
    ------
    InputError
        If its words count other cycles than were integrated, or it has more levels than any sweep.
    """
    refuse_levels(response)
    if not np.any(response.gain_std_db > 0.0):
        return StatedError(None, None)
    declared = _declared(response)
    if declared.components is None:
        return declared
    if _is_constant(response):
        return StatedError(
            None,
            declared.cycles,
            "gain_std_db is the same at every point, which scatter of a motion is not: "
            "it is not compared with simulated scatter",
        )
    if declared.note and not _is_like_readings(response):
        return StatedError(
            None,
            None,
            "gain_std_db does not follow how far readings lie from their neighbours: it is taken "
            f"for an error bar, not for scatter of the motion; {_cure(response)}",
        )
    return declared


def error_doubts(responses: Sequence[FrequencyResponse]) -> list[str]:
    """Why error columns of responses are not taken for scatter, each sentence once."""
    return list(dict.fromkeys(d for one in responses if (d := stated_error(one).doubt)))


def error_notes(responses: Sequence[FrequencyResponse]) -> list[str]:
    """What error columns are taken for that no word declares, each sentence once."""
    return list(dict.fromkeys(n for one in responses if (n := stated_error(one).note)))


def _declared(response: FrequencyResponse) -> StatedError:
    """What the response says itself: in words, by the older key, or not at all."""
    words, known = response.provenance.get(GAIN_STD_IS), response.integrate_cycles
    if words is None:
        return _by_older_key(response)
    found = _SCATTER.match(words.strip().lower()) if isinstance(words, str) else None
    if found is None:
        return StatedError(
            None,
            None,
            "gain_std_db is taken for an error bar, not for scatter of the motion, as "
            f"{GAIN_STD_IS} says {_shown(words)}; {_cure(response)}",
        )
    cycles = int(found[2])
    if known is not None and known != cycles:
        raise InputError(
            f"{GAIN_STD_IS} counts {cycles} cycles and integrate_cycles is {known}; "
            "give the cycles of the mean in both"
        )
    return StatedError(2 if found[1] == " of both components" else 1, cycles)


def _by_older_key(response: FrequencyResponse) -> StatedError:
    components = response.provenance.get(GAIN_STD_COMPONENTS)
    if components is None and _names_cycles_alone(response):
        components = 2
    if type(components) is int and components == 1:
        return StatedError(1, None)
    if type(components) is int and components == 2:
        return StatedError(
            2,
            None,
            note="gain_std_db is taken for cycle-to-cycle scatter of both components of the "
            f"reading, as the file gives cycles and nothing else; {_cure(response)}",
        )
    return StatedError(
        None,
        None,
        "gain_std_db is taken for an error bar, not for scatter of the motion, as nothing says "
        f"that it is; {_cure(response)}",
    )


def _names_cycles_alone(response: FrequencyResponse) -> bool:
    """Whether a response gives its cycles, and not even a kind: by the format it counts them."""
    cycles = response.settle_cycles is not None and response.integrate_cycles is not None
    return cycles and "kind" not in response.provenance


def _cure(response: FrequencyResponse) -> str:
    words = error_words(response.integrate_cycles or 30)
    return f"if it is scatter along the gain, write {GAIN_STD_IS} = '{words}'"


def _is_constant(response: FrequencyResponse) -> bool:
    """Whether no level with a few rows has two different errors."""
    parts = [response.gain_std_db[response.source_vpk == v] for v in response.levels_vpk]
    parts = [part[part > 0.0] for part in parts]
    several = [part for part in parts if len(part) >= 4]
    return bool(several) and all(np.ptp(part) <= 1e-6 * part.max() for part in several)


def _is_like_readings(response: FrequencyResponse) -> bool:
    """Whether stated errors go with how far each reading lies from its neighbours."""
    pairs = [_stated_and_shown(response.at_level(v)) for v in response.levels_vpk]
    stated, shown = np.concatenate(pairs, axis=1)
    if len(stated) < _JUDGED:
        return True
    apart = abs(float(np.median(shown - stated)))
    return apart < np.log(_WITHIN) and _rank_correlation(stated, shown) > _LEAST_CORRELATION


def _stated_and_shown(level: FrequencyResponse) -> NDArray[np.float64]:
    """Logarithms (2, rows) of stated errors and of distances to the neighbours."""
    level = level.take((level.gain_std_db > 0.0) & (np.abs(level.gain) > 0.0))
    _, first = np.unique(level.frequency_hz, return_index=True)
    level = level.take(first)
    if len(level) < 5:
        return np.empty((2, 0))
    channels = [np.log(np.abs(level.gain))]
    if np.all(level.phase_known):
        channels.append(np.unwrap(np.angle(level.gain)))
    off = [neighbour_residual(level.frequency_hz, channel) for channel in channels]
    shown = np.sqrt(2.0 * np.mean(np.square(off), axis=0))
    return np.log(np.stack([level.gain_std_db / DB_PER_NEPER, np.maximum(shown, 1e-12)]))


def _rank_correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    ranks = np.argsort(np.argsort(np.stack([one, other]), axis=1), axis=1)
    return float(np.asarray(np.corrcoef(ranks))[0, 1])


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
