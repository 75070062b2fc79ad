"""Running a safe-off recipe: every step is tried, whatever became of the one before.

Owns the record of the steps and the budget of time. Which steps a recipe has, and what proves
that the source is off, is each driver's matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from daq.analyser import SourceState
from daq.driving.conversation import Conversation
from daq.errors import LashbenchError
from daq.transports.base import Deadline

__all__ = ["Attempt", "SafeOff", "Step"]

_REPLY_S = 1.0
_LEAST_REPLY_S = 0.05
_DEAF_S = 6.0
"""Where nothing has answered for so long no further question is asked, and a command gets next to
no time. What follows, a new connection and the watchdog, begins anew."""

_Talk = TypeVar("_Talk", bound=Conversation)


@dataclass(frozen=True, slots=True)
class Step:
    """One thing that was tried, and what came of it."""

    what: str
    result: str
    """Reply, "done", or the error in full."""
    failed: bool


@dataclass(frozen=True, slots=True)
class SafeOff:
    """What is known of the source after the recipe, and every step that led there."""

    state: SourceState
    steps: tuple[Step, ...]

    def __str__(self) -> str:
        failed = "; ".join(f"{step.what}: {step.result}" for step in self.steps if step.failed)
        return f"source {self.state}" + (f" ({failed})" if failed else "")


class Attempt(Generic[_Talk]):
    """Runs steps, one after the other, and keeps what became of each.

    Parameters
    ----------
    dialogue
        A conversation of its own, which nobody else uses meanwhile.
    told
        Told before each exchange how long it may take at most, s; must not raise.
    budget_s
        Once this is spent every further question gets next to no time; every step is still tried.
    """

    def __init__(
        self, dialogue: _Talk, told: Callable[[float], None] | None, budget_s: float
    ) -> None:
        self.dialogue = dialogue
        self.dialogue.reply_s = _REPLY_S
        self.dialogue.on_exchange = told
        self.steps: list[Step] = []
        self.answered = False
        self._budget = Deadline.after(budget_s)
        self._deaf = Deadline.after(_DEAF_S)

    def act(self, what: str, action: Callable[[], str], *, asks: bool = False) -> str | None:
        """Try one thing; its result, None if it failed.

        Parameters
        ----------
        asks
            It ends well only where the instrument answered.
        """
        self.dialogue.reply_s = self.bound(_REPLY_S)
        try:
            result = action()
        except LashbenchError as error:
            self.steps.append(Step(what, str(error), failed=True))
            return None
        except Exception as error:  # whatever it is, the next step must still be tried
            fault = f"{type(error).__name__}: {error}"
            self.steps.append(Step(what, fault, failed=True))
            return None
        self.answered = self.answered or asks
        self.steps.append(Step(what, result, failed=False))
        return result

    def bound(self, seconds: float) -> float:
        """At most so long, less where the budget is spent."""
        left_s = self._budget.remaining_s
        if not self.answered:
            left_s = min(left_s, self._deaf.remaining_s)
        return max(_LEAST_REPLY_S, min(seconds, left_s))

    def send(self, line: str) -> None:
        """Try to send a command."""

        def action() -> str:
            self.dialogue.send(line)
            return "done"

        self.act(line, action)

    def ask(self, line: str) -> str | None:
        """Try to have a question answered."""
        if not self.answered and self._deaf.expired:
            result = f"not asked, as nothing was answered in {_DEAF_S:g} s"
            self.steps.append(Step(line, result, failed=True))
            return None
        return self.act(line, lambda: self.dialogue.ask(line), asks=True)

    def pause(self, seconds: float) -> str:
        """Let time pass, announced; for use as an action."""
        if self.dialogue.on_exchange is not None:
            self.dialogue.on_exchange(seconds)
        self.dialogue.transport.pause(seconds)
        return f"{seconds:.2f} s"

    def result(self, proven: bool) -> SafeOff:
        """What is known in the end."""
        if proven:
            state = SourceState.CONFIRMED_OFF
        else:
            state = SourceState.UNCONFIRMED if self.answered else SourceState.UNKNOWN
        return SafeOff(state, tuple(self.steps))
