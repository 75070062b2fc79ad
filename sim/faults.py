"""Faults on demand: what can go wrong, when it does, and how often.

Owns the names and parameters of all faults and the decision that one is due.
What a fault does is done where it strikes: in the instrument, in the adapter
or in the server.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from daq.errors import InputError

__all__ = ["CATALOGUE", "Fault", "FaultBoard", "FaultKind", "Phase", "parse_fault"]

Phase = Literal["prepare", "sweep", "read-out"]
PHASES: tuple[Phase, ...] = ("prepare", "sweep", "read-out")

_FOREVER = math.inf


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault.

    Parameters
    ----------
    does
        What it does, for people.
    point, phase
        When it strikes unless it is told otherwise.
    seconds, size
        Presets of its own parameters; None if it has no such parameter.
    """

    does: str
    point: int | None = None
    phase: Phase | None = None
    seconds: float | None = None
    size: int | None = None


CATALOGUE: dict[str, FaultKind] = {
    "dropped-connection": FaultKind("the connection breaks", point=3),
    "link-away": FaultKind("the adapter or gateway starts anew", point=3, seconds=3.0),
    "silence": FaultKind("the instrument falls silent", point=3, seconds=_FOREVER),
    "slow-reply": FaultKind("a reply comes late", phase="read-out", seconds=4.0),
    "garbage-bytes": FaultKind("noise bytes come before a reply", phase="read-out", size=5),
    "truncated-block": FaultKind("a block ends early", phase="read-out", size=16),
    "wrong-length": FaultKind("a block states a wrong length", phase="read-out", size=8),
    "missing-eoi": FaultKind("a reply ends without EOI", phase="read-out"),
    "overload-burst": FaultKind("both inputs are overdriven for one point", point=3),
    "stuck-measuring-bit": FaultKind("the sweep never reports its end", point=1),
    "stuck-parser": FaultKind("the parser hangs until a device clear", point=3),
    "lost-power": FaultKind("power fails; all settings are gone", point=3, seconds=1.0),
    "adapter-reset": FaultKind("the adapter restarts; its settings are gone", point=3, seconds=1.0),
    "error-queue-overflow": FaultKind("eight errors arrive at once", point=3),
    "hardware-error": FaultKind("the hardware reports a failure (-240)", point=3),
    "calibration-failure": FaultKind("the next calibration fails (-310)"),
    "missing-option": FaultKind("option 1D2 is not installed"),
}
"""Every fault by its stable name."""


@dataclass(slots=True)
class Fault:
    """A fault that is armed.

    It strikes at the first opportunity once `point` points have been begun
    (counted over all sweeps) and while the phase is right; then `times` times
    in all, 0 meaning always. `skip` opportunities are let pass first.
    """

    name: str
    point: int | None = None
    phase: Phase | None = None
    times: int = 1
    skip: int = 0
    seconds: float = 0.0
    size: int = 0
    struck: int = field(default=0, compare=False)


def parse_fault(text: str, catalogue: Mapping[str, FaultKind] | None = None) -> Fault:
    """Read ``NAME`` or ``NAME:key=value,key=value`` of a model's catalogue, or of the preset's.

    Raises
    ------
    InputError
        If name, key or value is not one of the catalogue's.
    """
    name, colon, rest = text.strip().partition(":")
    known = CATALOGUE if catalogue is None else catalogue
    if name not in known:
        raise InputError(f"fault {name!r} is not known; use one of: {', '.join(known)}")
    kind = known[name]
    given: dict[str, str] = {}
    for part in rest.split(",") if colon else ():
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not value or key in given:
            raise InputError(f"fault {text!r}: {part!r} is not KEY=VALUE, or comes twice")
        given[key] = value
    allowed = {"point", "phase", "times", "skip"}
    allowed |= {"seconds"} if kind.seconds is not None else set()
    allowed |= {"size"} if kind.size is not None else set()
    if wrong := set(given) - allowed:
        raise InputError(
            f"fault {name}: {', '.join(sorted(wrong))} is no parameter of it; "
            f"use {', '.join(sorted(allowed))}"
        )
    timed = "point" in given or "phase" in given
    return Fault(
        name=name,
        point=_count(name, "point", given) if "point" in given else (None if timed else kind.point),
        phase=_phase(name, given["phase"]) if "phase" in given else (None if timed else kind.phase),
        times=_count(name, "times", given, 1),
        skip=_count(name, "skip", given, 0),
        seconds=_seconds(name, given.get("seconds"), kind.seconds or 0.0),
        size=_count(name, "size", given, kind.size or 0),
    )


def _count(name: str, key: str, given: dict[str, str], preset: int = 0) -> int:
    value = given.get(key)
    if value is None:
        return preset
    if not (value.isascii() and value.isdigit()) or len(value) > 9:
        raise InputError(f"fault {name}: {key} {value!r} is not a whole number of 0 or more")
    return int(value)


def _phase(name: str, value: str) -> Phase:
    for phase in PHASES:
        if value == phase:
            return phase
    raise InputError(f"fault {name}: phase {value!r} is not one of: {', '.join(PHASES)}")


def _seconds(name: str, value: str | None, preset: float) -> float:
    if value is None:
        return preset
    try:
        seconds = float(value)
    except ValueError as error:
        raise InputError(f"fault {name}: seconds {value!r} is not a number") from error
    if not 0.0 <= seconds <= 1e6:
        raise InputError(f"fault {name}: seconds {value} must be between 0 and 1000000")
    return seconds


class FaultBoard:
    """All armed faults, asked at every opportunity."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._faults = list(faults)
        self.phase: Phase = "prepare"
        self.points_begun = 0

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Those that are armed, with how often each has struck."""
        return tuple(self._faults)

    def disarm(self) -> None:
        """Let nothing strike any more; what was broken stays so."""
        self._faults.clear()

    def take(self, name: str) -> Fault | None:
        """The fault of that name if it strikes now."""
        for fault in self._faults:
            if fault.name == name and self._due(fault):
                if fault.skip > 0:
                    fault.skip -= 1
                    continue
                fault.struck += 1
                return fault
        return None

    def _due(self, fault: Fault) -> bool:
        if fault.times and fault.struck >= fault.times:
            return False
        if fault.phase is not None and fault.phase != self.phase:
            return False
        return fault.point is None or self.points_begun >= fault.point
