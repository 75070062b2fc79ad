"""The catalogue as one mapping: what comes with lashbench, and what effect files of units define.

Owns the search for an effect by its identifier, and that no identifier means two things. It holds
no entry of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from daq.errors import ConfigurationError
from sim.drive.unit import Unit
from sim.effect import Effect
from sim.own_effects.definitions import defined_effects
from sim.own_effects.sources import announced

__all__ = ["Catalogue"]


class Catalogue(Mapping[str, Effect]):
    """Effects by identifier, those of effect files last, as soon as these were read.

    Parameters
    ----------
    built_in
        What comes with lashbench.
    """

    def __init__(self, built_in: Mapping[str, Effect]) -> None:
        self._built_in = built_in
        self._own: dict[str, tuple[str, Effect]] = {}
        self._known: set[str] = set()

    def __getitem__(self, identifier: str) -> Effect:
        if identifier in self._built_in:
            return self._built_in[identifier]
        self._take_up()
        return self._own[identifier][1]

    def __iter__(self) -> Iterator[str]:
        self._take_up()
        return iter([*self._built_in, *self._own])

    def __len__(self) -> int:
        self._take_up()
        return len(self._built_in) + len(self._own)

    def own_of(self, unit: Unit) -> tuple[str, ...]:
        """Identifiers of the effects that the unit's own files define, in their order.

        Raises
        ------
        ConfigurationError
            If the unit names such files and they were not read with it, or one is wrong.
        """
        if unit.own_effects is None:
            return ()
        if not unit.effect_sources:
            raise ConfigurationError(
                f"unit {unit.name} has effects of its own, in files that are not kept with a "
                f"measurement ({', '.join(unit.own_effects.files)}); give the unit file itself: "
                "--unit FILE --trust-effects"
            )
        self._take_up()
        return tuple(e.id for source in unit.effect_sources for e in defined_effects(source))

    def _take_up(self) -> None:
        """Take up the effects of files that were read since."""
        for source in announced():
            if source.digest in self._known:
                continue
            effects = defined_effects(source)
            for effect in effects:
                if effect.id in self._built_in:
                    raise ConfigurationError(
                        f"{source.file}: effect {effect.id!r} is one of the catalogue; give yours "
                        "another identifier"
                    )
                if effect.id in self._own:
                    raise ConfigurationError(
                        f"{source.file}: effect {effect.id!r} was read from "
                        f"{self._own[effect.id][0]} before; give it another identifier, or, if "
                        "the file was changed, start lashbench again"
                    )
            self._own.update({effect.id: (source.file, effect) for effect in effects})
            self._known.add(source.digest)
