"""The simulated analyser without a wire: an in-process transport for the address ``sim:``.

Owns the transport and the reading of what may follow ``sim:``. It talks to the
same bus as the adapters do; whatever differs on other wires is not here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from urllib.parse import parse_qsl

from daq.errors import BenchTimeout, ConfigurationError, LinkError
from daq.transports.base import Deadline, checked_line
from daq.transports.messages import MessageReader
from sim.drawn_effects import draw_hidden
from sim.effects import EffectSetting, parse_effect
from sim.faults import Fault
from sim.instrument.bus import Instrument, TalkState
from sim.instrument.pace import ByTheClock, Fast, Pace
from sim.models import Bench, Model, model_of
from sim.response import SteppedServo
from sim.unit import Unit

__all__ = ["Loopback", "LoopbackSettings", "open_loopback", "read_loopback_settings"]

_KEYS = {"ratio", "seed", "noise", "speed", "options", "effect", "fault", "hidden"}
_WAIT_S = 0.002
_RATIO = 0.25


class Loopback(MessageReader):
    """Messages straight onto the bus of a simulated analyser; see `daq.transports.base.Transport`.

    In fast operation each exchange lets one point of a running sweep be
    measured, so that whoever polls sees it go on; a wait costs no time.
    """

    def __init__(
        self, instrument: Instrument, pace: Pace | None = None, address: str = "sim:"
    ) -> None:
        super().__init__(address)
        self.instrument = instrument
        self._pace = pace or Fast(instrument)
        self._closed = False

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message, EOI with its last byte."""
        data = checked_line(line)
        self._begin()
        self._waiting = line
        while data:
            data = data[self.instrument.listen(data, end=True) :]
            if data:
                self._let_time_pass(deadline, f"{line!r} was not taken")
        self._check_link()

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte."""
        self._begin()
        while (byte := self.instrument.serial_poll()) is None:
            self._let_time_pass(deadline, "the serial poll was not answered")
        self._check_link()
        return byte

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument."""
        self._begin()
        self.instrument.device_clear()
        return True

    def pause(self, seconds: float) -> None:
        """Let time pass; in fast operation the instrument's work stands for it."""
        if isinstance(self._pace, Fast):
            self._pace.advance_point()
            return
        time.sleep(seconds)

    def close(self) -> None:
        """Let go of the wire; the instrument stays as it is."""
        self._closed = True

    def _begin(self) -> None:
        if self._closed:
            raise LinkError(f"{self.address}: the connection is closed")
        self._pace.touch()
        if isinstance(self._pace, Fast):
            self._pace.advance_point()
        else:
            self._pace.advance()
        self._check_link()

    def _check_link(self) -> None:
        damage = self.instrument.damage
        if damage.link_fault("dropped-connection") or damage.link_fault("link-away"):
            self._closed = True
            raise LinkError(f"{self.address}: the connection was lost at {self._waiting!r}")

    def _message(self, deadline: Deadline) -> bytes:
        """A whole reply, up to EOI."""
        self._begin()
        message = bytearray()
        while True:
            talk = self.instrument.talk()
            message += talk.data
            self._check_link()
            if talk.end:
                return bytes(message)
            if talk.state is not TalkState.DATA:
                begun = f" after {len(message)} bytes" if message else ""
                self._let_time_pass(deadline, f"no reply to {self._waiting!r} came{begun}")

    def _let_time_pass(self, deadline: Deadline, complaint: str) -> None:
        if deadline.expired:
            raise BenchTimeout(f"{self.address}: {complaint} within {deadline.span_s:g} s")
        if not self._pace.advance():
            time.sleep(min(_WAIT_S, deadline.remaining_s))


@dataclass(frozen=True, slots=True)
class LoopbackSettings:
    """What may follow ``sim:``, as in ``sim:?ratio=0.3&seed=1&fault=silence:point=5``.

    `hidden`: seed by which ratio and one effect are drawn, so that the address does not tell them.
    """

    ratio: float = _RATIO
    seed: int = 0
    noise_v: float = Bench().noise_v
    realtime: bool = False
    options: str | None = None
    effects: tuple[EffectSetting, ...] = ()
    faults: tuple[Fault, ...] = ()
    hidden: int | None = None


def read_loopback_settings(rest: str, model: Model | None = None) -> LoopbackSettings:
    """Read what follows ``sim:``.

    Raises
    ------
    ConfigurationError
        If a key or value is wrong; lists the keys.
    """
    known = model or model_of("")
    values: dict[str, list[str]] = {}
    if rest and not rest.startswith("?"):
        raise _refusal(rest, "should begin with '?'")
    try:
        pairs = parse_qsl(rest[1:], keep_blank_values=True, strict_parsing=True) if rest[1:] else []
    except ValueError as error:
        raise _refusal(rest, "is not KEY=VALUE&KEY=VALUE") from error
    for key, value in pairs:
        values.setdefault(key, []).append(value)
    if wrong := set(values) - _KEYS:
        raise _refusal(rest, f"has the unknown key {sorted(wrong)[0]!r}")
    once = [key for key, found in values.items() if len(found) > 1]
    if once and not set(once) <= {"effect", "fault"}:
        raise _refusal(rest, f"has {once[0]!r} twice")
    if "hidden" in values and (told := sorted(values.keys() & {"ratio", "effect"})):
        raise _refusal(rest, f"has hidden beside {told[0]}, which tells what is hidden")
    if "options" in values and not known.has_options:
        raise _refusal(rest, f"has options, which a {known.name} does not list")
    speed = values.get("speed", ["fast"])[0]
    if speed not in ("fast", "realtime"):
        raise _refusal(rest, f"has speed {speed!r}; it is fast or realtime")
    return LoopbackSettings(
        ratio=_number(rest, values, "ratio", _RATIO, 1.0),
        seed=int(_number(rest, values, "seed", 0.0, 1e9)),
        noise_v=_number(rest, values, "noise", Bench().noise_v, 10.0),
        realtime=speed == "realtime",
        options=values["options"][0] if "options" in values else None,
        effects=tuple(parse_effect(text) for text in values.get("effect", [])),
        faults=tuple(known.parse_fault(text) for text in values.get("fault", [])),
        hidden=int(_number(rest, values, "hidden", 0.0, 1e9)) if "hidden" in values else None,
    )


def _number(rest: str, values: dict[str, list[str]], key: str, preset: float, high: float) -> float:
    text = values.get(key, [""])[0]
    if key not in values:
        return preset
    try:
        number = float(text)
    except ValueError as error:
        raise _refusal(rest, f"has {key} {text!r}, which is no number") from error
    if not 0.0 <= number <= high or (key in ("seed", "hidden") and number % 1):
        raise _refusal(rest, f"has {key} {text}; it must be from 0 to {high:g}")
    return number


def _refusal(rest: str, fault: str) -> ConfigurationError:
    return ConfigurationError(
        f"instrument 'sim:{rest}' {fault}; "
        "keys are ratio, seed, noise, speed, options, effect, fault and hidden"
    )


def open_loopback(
    unit: Unit,
    ratio: float | None = None,
    effects: Sequence[EffectSetting] = (),
    progress: Callable[[Instrument], None] | None = None,
    scheme: str = "",
) -> Callable[[str], Loopback]:
    """A factory of ``sim:`` transports, each with an instrument of its own.

    Parameters
    ----------
    unit
        The unit behind the simulated inputs.
    ratio, effects
        Used where the address itself says nothing.
    progress
        Called with each new instrument, for whoever wants to look inside.
    scheme
        That of the driver, which says what instrument is simulated.

    Raises
    ------
    ConfigurationError
        If no instrument of that driver is simulated.
    """
    model = model_of(scheme)

    def open_one(rest: str) -> Loopback:
        wanted = read_loopback_settings(rest, model)
        share = wanted.ratio if "ratio=" in rest or ratio is None else ratio
        if unit.stages == 1 and "ratio=" not in rest and ratio is None:
            share = 1.0
        own = wanted.effects or tuple(effects)
        if wanted.hidden is not None:
            share, effect = draw_hidden(unit, wanted.hidden)
            own = (effect,)
        bench = Bench(wanted.seed, wanted.noise_v, options=wanted.options, faults=wanted.faults)
        servo = SteppedServo(unit, share, own, seed=wanted.seed)
        instrument = model.build(servo, bench)
        if progress is not None:
            progress(instrument)
        pace: Pace = ByTheClock(instrument) if wanted.realtime else Fast(instrument)
        return Loopback(instrument, pace, f"sim:{rest}")

    return open_one
