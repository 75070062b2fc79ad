"""``lashbench plot``: one or several responses as a picture, with the model beside them.

Owns the options of the verb, and which model a stored measurement is shown with. What the picture
shows is the analysis's. It must never estimate: a model is given, or was accepted before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from daq.errors import ConfigurationError, InputError
from daq.servers.place import HistoryPlace, files_of
from tui.options import HistoryOption, Real
from tui.places import history_path, measurement_number
from tui.reading_options import NO_OPTIONS, ReadingOptions, read_file
from tui.text.output import Console, Injected

if TYPE_CHECKING:
    from analysis.estimate.datasheet_band import Known
    from analysis.plots import Curve
    from daq.frf import FrequencyResponse
    from sim.effects import EffectSetting
    from sim.unit import Unit

__all__ = ["plot"]


@dataclass(frozen=True, slots=True)
class _Model:
    """What is simulated beside a response."""

    unit: Unit
    known: Known


@dataclass(frozen=True, slots=True)
class _Wanted:
    """The options that say which model."""

    unit: str | None
    ratio: float | None
    effects: tuple[EffectSetting, ...]


def plot(
    *sources: Annotated[str, Parameter(name="FILE_OR_ID")],
    out: Path,
    db: HistoryOption = None,
    only_level: list[Real] | None = None,
    model: bool = False,
    unit: Annotated[
        str | None, Parameter(name="--unit", help="Of the model: adss, edss or a unit file.")
    ] = None,
    ratio: Real | None = None,
    effect: list[str] | None = None,
    given: ReadingOptions = NO_OPTIONS,
    console: Injected,
) -> None:
    """Draw gain and phase over frequency of one or several responses.

    One response has a colour per source level, several have a colour each. Bands are one standard
    error where the file states it.

    Parameters
    ----------
    sources
        Responses in any format that can be read, or identifiers of measurements as `history`
        lists them.
    out
        Picture to write: png, svg or pdf by its suffix.
    db
        The bench's history, a file or postgresql://USER@HOST/DATABASE; yours, if left out.
    only_level
        Draw this source level only, in V peak; repeat it for several.
    model
        Simulate the same sweeps and draw them dashed, in the band that holds the middle 68 % of
        units of the datasheet: with --unit, or of an identifier with the answer that the history
        holds.
    ratio
        Contribution ratio of the model, 0 to 1; any, if left out and not known.
    effect
        Extension of the model, ID:param=value[,param=value]; repeat it for several.
    """
    from analysis.drawing.picture import checked_picture
    from sim.effects import parse_effect
    from sim.unit import load_unit

    if not sources:
        raise InputError("FILE_OR_ID is missing; give a response file or an identifier")
    numbers = [measurement_number(source, db) for source in sources]
    files = [Path(one) for one, number in zip(sources, numbers, strict=True) if number is None]
    history = None if len(files) == len(sources) else history_path(db)
    checked_picture(out, [*files, *files_of(history)])
    if given != NO_OPTIONS and not files:
        raise InputError(
            "measurements are in a history, which says everything; leave out the options that "
            "complete a file"
        )
    for name, value in (("--unit", unit), ("--ratio", ratio), ("--effect", effect)):
        if value is not None and not model:
            raise InputError(f"{name} is for the model; give --model, too")
    if effect and ratio is None:
        raise InputError("--effect extends a model of --ratio; give --ratio, too")
    if ratio is not None and not 0.0 <= ratio <= 1.0:
        raise InputError(f"--ratio {ratio:g} is no contribution ratio; give 0 to 1")
    if model and files and unit is None:
        raise InputError("--model of a file needs --unit; give adss, edss or a unit file")
    wanted = _Wanted(unit, ratio, tuple(map(parse_effect, effect or ())))
    levels = tuple(only_level or ())
    curves = []
    for source, number, name in zip(sources, numbers, _names(sources, numbers), strict=True):
        if number is None:
            response, chosen = read_file(source, given, console), None
        else:
            assert history is not None
            response, chosen = _stored(history, number, wanted, model)
        response = _at_levels(response, levels, source)
        if model:
            chosen = chosen or _given(load_unit(unit or ""), wanted)
        curves.append(_curve(name, response, chosen, console))
    from analysis.plots import save_overlay

    save_overlay(curves, out)
    console.note(f"wrote {out}")


def _names(sources: Sequence[str], numbers: Sequence[int | None]) -> list[str]:
    """Names for a legend: those of the files, with folders where two files have the same."""
    short = [
        f"measurement {number}" if number is not None else Path(source).name
        for source, number in zip(sources, numbers, strict=True)
    ]
    return [
        source if number is None and short.count(name) > 1 else name
        for source, number, name in zip(sources, numbers, short, strict=True)
    ]


def _at_levels(
    response: FrequencyResponse, levels: Sequence[float], source: str
) -> FrequencyResponse:
    """The levels that are asked for; levels that a file rounds are the same."""
    import numpy as np

    if not levels:
        return response
    kept = np.isclose(response.source_vpk[:, None], levels, rtol=1e-6, atol=0.0).any(axis=1)
    if not kept.any():
        known = ", ".join(f"{v:g}" for v in response.levels_vpk if np.isfinite(v)) or "none"
        wanted = ", ".join(f"{v:g}" for v in levels)
        raise InputError(f"{source}: has no reading at --only-level {wanted} V; it has {known}")
    return response.take(kept)


def _stored(
    db: HistoryPlace, number: int, wanted: _Wanted, model: bool
) -> tuple[FrequencyResponse, _Model | None]:
    """A stored measurement, and the model that was accepted for it unless one is given."""
    from daq.store import Store
    from sim.unit import load_unit
    from tui.measurements.measured_unit import unit_as_measured

    with Store(db, read_only=True) as store:
        response = store.response(number)
        if not model:
            return response, None
        if wanted.unit is not None:
            subject = load_unit(wanted.unit)
        else:
            try:
                subject = unit_as_measured(store.measurement(number))
            except ConfigurationError as error:
                raise InputError(f"{error}; give --unit") from error
        if wanted.ratio is not None:
            return response, _given(subject, wanted)
        from analysis.answer import accept_model
        from analysis.estimate.datasheet_band import Known
        from sim.effects import EffectSetting
        from tui.measurements.stored_answers import kept_diagnosis, kept_estimate

        kept = kept_diagnosis(store, number, subject)
        document = None if kept is None else kept.document
        answer = accept_model(kept_estimate(store, number, subject), document)
    if answer.contribution_ratio is None:
        return response, _Model(subject, Known())
    named = document["causes"] if document is not None else ()
    effects = tuple(
        EffectSetting(
            one["effect"], {key: float(size["value"]) for key, size in one["parameters"].items()}
        )
        for one in named
    )
    ratio = answer.contribution_ratio
    about = float(ratio["value"]), float(ratio.get("std") or 0.0)
    return response, _Model(subject, Known(about, effects=effects, words="by the stored answer"))


def _given(unit: Unit, wanted: _Wanted) -> _Model:
    from analysis.estimate.datasheet_band import Known

    told = None if wanted.ratio is None else (wanted.ratio, 0.0)
    return _Model(unit, Known(told, effects=wanted.effects))


def _curve(
    name: str,
    response: FrequencyResponse,
    model: _Model | None,
    console: Console,
) -> Curve:
    from analysis.plots import Curve, predicted

    if model is None:
        return Curve(name, response)
    from analysis.estimate.datasheet_band import datasheet_band
    from analysis.observation.joint import unit_doubts

    unit, known = model.unit, model.known
    for doubt in unit_doubts([response], unit):
        console.note(f"warning: {doubt}")
    extended = f" with {' and '.join(one.id for one in known.effects)}" if known.effects else ""
    at = f"r = {known.ratio[0]:.3f}" if known.ratio is not None else "any r"
    console.note(f"simulating {name}: {unit.name}, {at}{extended}")
    beside: tuple[FrequencyResponse, ...] = ()
    if known.ratio is not None:
        beside = predicted(response, unit, known.ratio[0], known.effects)
    band = datasheet_band(response, unit, known, progress=console.progress)
    console.note(band.words)
    return Curve(name, response, beside, band)
