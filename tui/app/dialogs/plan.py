"""The dialog in which the sweep is chosen: recipe, levels, band, points, cycles.

Owns the reading of its fields, and stays open with what was typed until the sweep is accepted.
Whether it is allowed is for the limits to say, which whoever opens the dialog asks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical

from daq.plan import SweepPlan
from tui.app.dialogs.form import FormDialog
from tui.app.state.desk import NO_RECIPE
from tui.app.widgets.plain import Caption, Field, Words
from tui.measure_options import PlanOptions
from tui.options import real_number

__all__ = ["PlanChoice", "PlanDialog"]

_FIELDS = (
    ("recipe", "recipe", f"name, file, {NO_RECIPE}"),
    ("levels", "source levels", "V peak: 1 2.5"),
    ("start", "start", "Hz"),
    ("stop", "stop", "Hz"),
    ("points", "points a level", ""),
    ("spacing", "spacing", "lin or log"),
    ("direction", "direction", "up or down"),
    ("settle", "settle cycles", ""),
    ("integrate", "integrate cycles", ""),
    ("adaptive", "refine", "yes or no"),
)


@dataclass(frozen=True, slots=True)
class PlanChoice:
    """What was typed; `recipe` is a name, a path, or `NO_RECIPE`."""

    recipe: str
    options: PlanOptions


class PlanDialog(FormDialog[PlanChoice]):
    """Asks for a plan; gives None where the old one is to stay.

    Parameters
    ----------
    plan
        The sweep that stands, if there is one.
    options
        What the operator said of it.
    recipe
        The recipe in force, or `NO_RECIPE`.
    heading
        What it is, where it is not the sweep that stands.
    judge
        Called with each choice; closes the dialog by `accept`, or has it say why by `refuse`.
    """

    DEFAULT_CSS = """
    PlanDialog Label { width: 18; }
    PlanDialog Input { width: 22; }
    PlanDialog .unit { width: 1fr; padding: 0 1; color: $text-muted; }
    """

    def __init__(
        self,
        plan: SweepPlan | None,
        options: PlanOptions,
        recipe: str,
        judge: Callable[[PlanDialog, PlanChoice], None],
        heading: str = "The sweep",
    ) -> None:
        super().__init__()
        self._heading = heading
        self._values = _texts(plan, options) | {"recipe": recipe}
        self._judge = judge

    def compose(self) -> ComposeResult:
        """A line per field."""
        with Vertical(id="dialog"):
            yield Words(self._heading, classes="heading")
            for name, label, unit in _FIELDS:
                with Horizontal(classes="field"):
                    yield Caption(label)
                    yield Field(self._values[name], id=f"plan-{name}", compact=True)
                    yield Caption(unit, classes="unit")
            yield Words("", id="fault")
            yield Words("Enter takes it, Esc keeps the old plan, Tab goes on", id="keys")

    def on_input_submitted(self, event: Field.Submitted) -> None:
        """Read the fields; stay where one is wrong."""
        event.stop()
        try:
            choice = self._choice()
        except ValueError as error:
            self.refuse(str(error))
            return
        self.refuse("")
        self._judge(self, choice)

    def _choice(self) -> PlanChoice:
        recipe = self._text("recipe") or NO_RECIPE
        others = [name for name, _, _ in _FIELDS if name != "recipe"]
        if recipe != self._values["recipe"] and all(
            self._text(name) == self._values[name] for name in others
        ):
            # Another recipe alone: its own sweep is meant.
            return PlanChoice(recipe, PlanOptions())
        return PlanChoice(recipe, self._options())

    def _options(self) -> PlanOptions:
        levels = tuple(real_number(word) for word in self._text("levels").split())
        if not levels:
            raise ValueError("levels: give one or more in V peak")
        return PlanOptions(
            levels_vpk=levels,
            start_hz=self._number("start"),
            stop_hz=self._number("stop"),
            points=self._count("points"),
            spacing=self._word("spacing", ("lin", "log")),
            direction=self._word("direction", ("up", "down")),
            settle_cycles=self._count("settle"),
            integrate_cycles=self._count("integrate"),
            adaptive=self._word("adaptive", ("no", "yes")) == "yes",
        )

    def _number(self, name: str) -> float:
        try:
            return real_number(self._text(name))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error

    def _text(self, name: str) -> str:
        return self.query_one(f"#plan-{name}", Field).value.strip()

    def _count(self, name: str) -> int:
        text = self._text(name)
        if not (text.isascii() and text.isdigit()):
            raise ValueError(f"{name}: {text!r} is not a whole number")
        return int(text)

    def _word(self, name: str, allowed: tuple[str, ...]) -> str:
        text = self._text(name).lower()
        if text not in allowed:
            raise ValueError(f"{name}: {text!r} is not {' or '.join(allowed)}")
        return text


def _texts(plan: SweepPlan | None, options: PlanOptions) -> dict[str, str]:
    if plan is None:
        return {name: "" for name, _, _ in _FIELDS} | {
            "spacing": "lin", "direction": "up", "settle": "20", "integrate": "30", "adaptive": "no"
        }  # fmt: skip
    steps = {round(b - a, 6) for a, b in zip(plan.frequencies_hz, plan.frequencies_hz[1:])}  # noqa: B905
    return {
        "levels": " ".join(f"{level:g}" for level in plan.levels_vpk),
        "start": f"{min(plan.frequencies_hz):g}",
        "stop": f"{max(plan.frequencies_hz):g}",
        "points": str(len(plan.frequencies_hz)),
        "spacing": options.spacing or ("lin" if len(steps) <= 1 else "log"),
        "direction": plan.direction,
        "settle": str(plan.settle_cycles),
        "integrate": str(plan.integrate_cycles),
        "adaptive": "yes" if options.adaptive else "no",
    }
