"""What a response was measured with: only a stepped sine is compared with simulations.

Owns the reading of what a response says of its excitation. It alters no response.
"""

from __future__ import annotations

from daq.frf import FrequencyResponse

__all__ = ["excitation_doubt"]

_STEPPED = ("stepped", "swept sine", "swept-sine")


def excitation_doubt(response: FrequencyResponse) -> str:
    """Why a response cannot be compared with a stepped sine, in words; empty if it can.

    One that does not say its excitation is taken as a stepped sine.
    """
    said = " ".join(str(response.provenance.get("excitation") or "").split())
    if not said or any(word in said.casefold() for word in _STEPPED):
        return ""
    return (
        f"the response was estimated from {said[:60]}, not from a stepped sine; a servo with "
        "backlash answers each signal differently, and only a sine of one level and frequency is "
        "simulated; measure it with a stepped sine, or give `frf` a record of one"
    )
