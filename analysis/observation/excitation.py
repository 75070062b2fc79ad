"""What a response was measured with, and whether simulations can be driven by the same.

Owns the reading of what a response says of its excitation. It alters no response.
"""

from __future__ import annotations

from collections.abc import Sequence

from daq.errors import InputError
from daq.excitation.signal import Excitation, excitation_of
from daq.frf import FrequencyResponse

__all__ = ["excitation_doubt", "refuse_signal", "signal_of", "sine_doubt"]

_STEPPED = ("stepped", "swept sine", "swept-sine")


def sine_doubt(response: FrequencyResponse) -> str:
    """Why a response is none of a stepped sine, in words; empty if it is.

    One that does not say its excitation is taken as a stepped sine.
    """
    said = _said(response)
    if not said:
        return ""
    return (
        f"the response was estimated from {said}, not from a stepped sine; a servo with backlash "
        "answers each signal differently"
    )


def signal_of(response: FrequencyResponse) -> Excitation | None:
    """The signal that simulations must be driven by; None for a stepped sine.

    Raises
    ------
    InputError
        If what the response states is no signal.
    """
    return excitation_of(response.provenance) if _said(response) else None


def excitation_doubt(response: FrequencyResponse) -> str:
    """Why no simulation can be driven as a response was, in words; empty if one can."""
    doubt = sine_doubt(response)
    if not doubt:
        return ""
    try:
        signal = signal_of(response)
    except InputError as error:
        return str(error)
    if signal is not None and response.integrate_cycles is not None:
        return ""
    return (
        f"{doubt}, and the file does not say the signal; measure it with a stepped sine, or make "
        "the file with `frf` from a record of a periodic signal, or of noise by H1"
    )


def refuse_signal(responses: Sequence[FrequencyResponse]) -> None:
    """Refuse for a diagnosis what was not measured with a stepped sine.

    Raises
    ------
    InputError
        If one was; says what can be done with it.
    """
    for one in responses:
        if doubt := sine_doubt(one):
            raise InputError(
                f"{doubt}: `diagnose` knows causes by a stepped sine alone; measure one, or give "
                "this response to `estimate`, which simulates its own signal where it is stated"
            )


def _said(response: FrequencyResponse) -> str:
    """The excitation in words, if it is said and no stepped sine."""
    said = " ".join(str(response.provenance.get("excitation") or "").split())
    return "" if any(word in said.casefold() for word in _STEPPED) else said[:60]
