"""Names for a notebook: ``import lashbench as lb``, then ``lb.read``, ``lb.estimate`` and so on.

Owns these names and how a result shows itself in a notebook. It computes nothing and loads no
library before a name is used. Progress goes to stderr.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.servers.place import HistoryPlace, parse_place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daq.frf import FrequencyResponse
    from daq.plan import SweepPlan

__distribution__ = "lashbench"
"""Another distribution may bring a package of this name; `tui.entry` tells them apart."""

__all__ = ["Result", "diagnose", "estimate", "extract", "measure", "plot", "read"]


class Result:
    """What a function here found: lines of text, a document, a picture, and all of its fields.

    Parameters
    ----------
    kind
        Which function made it.
    value
        What the analysis gave; its attributes are attributes of this, too.
    response
        The response that it is of.
    """

    def __init__(self, kind: str, value: Any, response: FrequencyResponse) -> None:
        self.kind, self.value, self.response = kind, value, response

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "value":
            raise AttributeError(name)
        return getattr(self.value, name)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.value)

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, place: Any) -> Any:
        return self.value[place]

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        if self.kind == "extract":
            from analysis.resonance import summary

            return summary(self.value)
        if self.kind == "read":
            low, high = self.response.frequency_hz.min(), self.response.frequency_hz.max()
            levels = ", ".join(f"{level:g}" for level in self.response.levels_vpk)
            name = f"{self.response.unit}, {len(self.response)} points"
            return [f"{name}, {low:g} to {high:g} Hz at {levels} V peak"]
        lines: list[str] = self.value.summary()
        return lines

    def to_json(self) -> dict[str, Any]:
        """The document of the verb of the same name; a response has none."""
        if self.kind == "extract":
            from analysis.resonance import to_json

            return to_json(self.value)
        document: dict[str, Any] = self.value.to_json()
        return document

    def plot(self) -> Figure:
        """The response of it as a Bode figure, with ARF and RF where they were extracted."""
        if self.kind == "extract":
            from analysis.response_figure import draw_response

            return draw_response(self.response, self.value)
        return plot(self)

    def __repr__(self) -> str:
        from daq.untrusted.visible_text import visible

        return visible("\n".join(self.summary()))

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(repr(self))}</pre>"


def read(path: str | Path) -> Result:
    """Read a response file of any known format.

    Raises
    ------
    LashbenchError
        As `daq.formats.read_response`.
    """
    from daq.formats import read_response

    response = read_response(path)
    return Result("read", response, response)


def measure(
    plan: SweepPlan,
    unit: str = "adss",
    instrument: str = "sim:",
    *,
    serial: str = "",
    bench: str = "default",
    db: str | HistoryPlace | None = None,
    yes: bool = False,
) -> Result:
    """Measure a unit and keep every point in a history; the source is off at every end.

    Parameters
    ----------
    plan
        What to sweep.
    unit, instrument, serial, bench
        As the options of ``lashbench measure``, and with the same limits.
    db
        The history; yours, if left out.
    yes
        That the bench is ready and safe. Needed for any instrument that is not simulated.

    Raises
    ------
    InputError
        If `yes` is needed.
    LimitError
        If a limit of bench, unit or instrument forbids the plan; nothing was sent.
    MeasurementError
        If the sweep is not complete, or the source is not confirmed off.
    LashbenchError
        As `lashbench measure`.
    """
    from daq.errors import InputError, MeasurementError
    from daq.store import Store
    from tui.bench import drives_hardware
    from tui.measure_options import PlanOptions, session_request
    from tui.measurements.running import run_session
    from tui.places import history_path
    from tui.session_words import exit_code, tell_event
    from tui.text.output import Console
    from tui.unit_under_test import read_unit

    if drives_hardware(instrument) and not yes:
        raise InputError(f"{instrument}: drives hardware; see that it is safe, and give yes=True")
    console = Console()
    subject = read_unit(unit, console)
    history = history_path(parse_place(db) if isinstance(db, str) else db, create=True)
    request = session_request(
        PlanOptions(), unit, subject, instrument, history,
        recipe=None, bench=bench, resume=None, remeasure=None, run_in=None,
        remarks={"serial": serial, "operator": "", "notes": ""}, plan=plan,
    )  # fmt: skip
    end, fault = run_session(instrument, subject, history, request, console, tell_event)
    if fault is not None:
        raise fault
    if exit_code(end) != 0:
        raise MeasurementError(
            f"measurement {end.measurement} is {end.state}: {end.reason}; resume it with "
            f"lashbench measure --resume {end.measurement}"
        )
    with Store(history, read_only=True) as store:
        response = store.response(end.measurement)
    return Result("read", response, response)


def extract(response: Result | FrequencyResponse) -> Result:
    """Read ARF, RF and damping at each source level (`analysis.resonance.extract`)."""
    from analysis.resonance import extract as extracted

    plain = _plain(response)
    return Result("extract", extracted(plain), plain)


def estimate(response: Result | FrequencyResponse, unit: str = "adss") -> Result:
    """Estimate the backlash of each stage (`analysis.estimate.estimate_response`)."""
    from analysis.estimate import estimate_response
    from sim.unit import load_unit

    plain, subject = _checked(response, load_unit(unit))
    made = estimate_response(plain, subject, cache=_cache(), progress=_progress())
    return Result("estimate", made, plain)


def diagnose(response: Result | FrequencyResponse, unit: str = "adss") -> Result:
    """Find what the simulation gets wrong, and why (`analysis.diagnosis.diagnose_response`)."""
    from analysis.diagnosis import diagnose_response
    from sim.unit import load_unit

    plain, subject = _checked(response, load_unit(unit))
    made = diagnose_response(plain, subject, cache=_cache(), progress=_progress())
    return Result("diagnose", made, plain)


def plot(
    *responses: Result | FrequencyResponse,
    names: Sequence[str] = (),
    unit: str | None = None,
    ratio: float | None = None,
) -> Figure:
    """Draw one or several responses, with the model of a unit and the band of its datasheet.

    Without a ratio the band is that of any ratio (`analysis.estimate.datasheet_band`).

    Raises
    ------
    InputError
        If there are too many, not as many names, or a ratio without a unit.
    """
    from analysis.estimate.datasheet_band import Known, datasheet_band
    from analysis.plots import Curve, draw_overlay, predicted
    from daq.errors import InputError
    from sim.unit import load_unit

    plain = [_plain(one) for one in responses]
    shown = list(names) or [f"response {number}" for number in range(1, len(plain) + 1)]
    if len(shown) != len(plain):
        raise InputError(f"{len(shown)} names for {len(plain)} responses; give one for each")
    if unit is None and ratio is not None:
        raise InputError("a ratio is that of a unit's model; give the unit, too")
    curves = []
    for name, response in zip(shown, plain, strict=True):
        if unit is None:
            curves.append(Curve(name, response))
            continue
        subject, known = load_unit(unit), Known(None if ratio is None else (ratio, 0.0))
        model = () if ratio is None else predicted(response, subject, ratio)
        band = datasheet_band(response, subject, known, progress=_progress())
        curves.append(Curve(name, response, model, band))
    return draw_overlay(curves)


def _plain(response: Any) -> Any:
    return response.response if isinstance(response, Result) else response


def _checked(response: Any, unit: Any) -> tuple[Any, Any]:
    """A response that does not look like a usual mistake, as the verbs ask for it."""
    from analysis.observation.input_check import check_inputs

    plain = _plain(response)
    check_inputs([plain], unit, way_on="")
    return plain, unit


def _cache() -> Path:
    from tui.places import cache_folder

    return cache_folder()


def _progress() -> Any:
    from tui.text.output import Console

    return Console().progress
