"""Effects that a source defines: executed once, checked like entries of the catalogue.

Owns the one place in which a file given by a user is executed, what such a file must define, and
that a fault in it becomes one line with file and line number. It decides nothing about trust.
"""

from __future__ import annotations

import math
import re
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from daq.errors import ConfigurationError, LashbenchError
from sim.drive.unit import Unit
from sim.drivetrain import Drivetrain
from sim.effect import Effect, EffectParameter
from sim.own_effects.sources import EffectSource

__all__ = ["defined_effects"]

_IDENTIFIER = re.compile(r"[a-z][a-z0-9-]{0,63}")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,31}")
_TEXTS = ("meaning", "bench_cause", "check")


@cache
def defined_effects(source: EffectSource) -> tuple[Effect, ...]:
    """Every `Effect` that is a name of the file's own level, in the order of their definition.

    Raises
    ------
    ConfigurationError
        If the file fails, defines no effect, or one is not a whole entry.
    """
    names: dict[str, Any] = {"__name__": "own_effect", "__file__": source.file}
    _guarded(source, "", exec)(_compiled(source), names)
    found: dict[str, Effect] = {}
    for value in names.values():
        if not isinstance(value, Effect):
            continue
        if found.setdefault(str(value.id), value) is not value:
            raise ConfigurationError(f"{source.file}: effect {value.id!r} is defined twice")
    if not found:
        raise ConfigurationError(
            f"{source.file}: defines no effect; assign an Effect of sim.catalogue to a name"
        )
    return tuple(_checked(source, effect) for effect in found.values())


def _compiled(source: EffectSource) -> Any:
    try:
        return compile(source.text, source.file, "exec", dont_inherit=True)
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        place = f" line {line}" if line else ""
        reason = getattr(error, "msg", None) or error
        raise ConfigurationError(f"{source.file}{place}: is not Python ({reason})") from error


def _checked(source: EffectSource, effect: Effect) -> Effect:
    """The effect with its functions guarded."""
    of = f"effect {effect.id!r}"
    faults = [text for text in _faults(effect) if text]
    if faults:
        raise ConfigurationError(f"{source.file}: {of}: {'; '.join(faults)}")

    def parameter(one: EffectParameter) -> EffectParameter:
        ends = _guarded(source, f"{of}: range of {one.name}", one.range)
        return replace(one, range=_ends(source, f"{of}: range of {one.name}", one, ends))

    def change(name: str, wanted: type) -> Callable[..., Any] | None:
        function = getattr(effect, name)
        what = f"{of}: {name}"
        return function and _returning(source, what, wanted, _guarded(source, what, function))

    inertia = effect.added_inertia
    return replace(
        effect,
        parameters=tuple(map(parameter, effect.parameters)),
        on_unit=change("on_unit", Unit),
        on_drivetrain=change("on_drivetrain", Drivetrain),
        added_inertia=inertia and _guarded(source, f"{of}: added_inertia", inertia),
    )


def _faults(effect: Effect) -> list[str]:
    names = [one.name for one in effect.parameters if isinstance(one, EffectParameter)]
    changes = [effect.on_unit, effect.on_drivetrain]
    return [
        "" if _matches(_IDENTIFIER, effect.id) else
        "an identifier is lower-case letters, digits and hyphens",
        "" if names and len(names) == len(effect.parameters) else
        "parameters must be EffectParameter, one or more",
        "" if len(set(names)) == len(names) else "two parameters have the same name",
        *("" if _matches(_NAME, name) else f"{name!r} is no name of a parameter" for name in names),
        "" if effect.site in ("plant", "chain") else "site must be 'plant' or 'chain'",
        *("" if _is_line(getattr(effect, name)) else f"{name} must be one line of text"
          for name in _TEXTS),
        "" if sum(callable(one) for one in changes) == 1 and None in changes else
        "give exactly one function, on_unit or on_drivetrain",
        "" if effect.resonance in ("", *names) else "resonance is the name of no parameter",
    ]  # fmt: skip


def _matches(pattern: re.Pattern[str], text: object) -> bool:
    return isinstance(text, str) and pattern.fullmatch(text) is not None


def _is_line(text: object) -> bool:
    return isinstance(text, str) and bool(text.strip()) and text.isprintable()


def _ends(
    source: EffectSource, what: str, parameter: EffectParameter, range_: Callable[..., Any]
) -> Callable[[Unit], tuple[float, float]]:
    """The range of a parameter, refused where no size can be drawn from it."""

    def ends(unit: Unit) -> tuple[float, float]:
        try:
            low, high = (float(one) for one in range_(unit))
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        least, most = parameter.allowed
        if not (math.isfinite(high) and 0.0 <= low < high and least <= low and high <= most):
            raise ConfigurationError(
                f"{source.file}: {what} is {low:g} to {high:g} for unit {unit.name}; give two "
                f"finite numbers, the lower first, 0 or more, and within {least:g} to {most:g}"
            )
        return low, high

    return ends


def _returning(
    source: EffectSource, what: str, wanted: type, function: Callable[..., Any]
) -> Callable[..., Any]:
    def checked(*given: Any) -> Any:
        result = function(*given)
        if not isinstance(result, wanted):
            raise ConfigurationError(
                f"{source.file}: {what} returns {type(result).__name__}; it must return a "
                f"{wanted.__name__}"
            )
        return result

    return checked


def _guarded(source: EffectSource, what: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function; what it raises is told with the line of the file."""

    def guarded(*given: Any) -> Any:
        try:
            return function(*given)
        except (LashbenchError, MemoryError):
            raise
        except (Exception, SystemExit) as error:
            frames = traceback.extract_tb(error.__traceback__)
            line = next((f.lineno for f in reversed(frames) if f.filename == source.file), None)
            place = f" line {line}" if line else ""
            of = f"{what}: " if what else ""
            told = " ".join(str(error).split())
            raise ConfigurationError(
                f"{source.file}{place}: {of}{type(error).__name__}: {told}"
            ) from error

    return guarded
