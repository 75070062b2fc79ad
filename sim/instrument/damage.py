"""What faults do to one instrument: silence, late and damaged replies, a hanging parser.

Owns the state of damage done. When a fault is due is `sim.faults`' matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from sim.faults import Fault, FaultBoard

__all__ = ["Damage"]

_NOISE = b"\x00\xff\x15\x7f\x80\x01\xaa"
_LINK_FAULTS = ("dropped-connection", "adapter-reset", "link-away")


class Damage:
    """Damage done to an instrument and its link."""

    def __init__(self, faults: FaultBoard, clock: Callable[[], float]) -> None:
        self._faults = faults
        self._clock = clock
        self._dead_until = -math.inf
        self._late_until = -math.inf
        self._parser_stuck = False
        self._power_failed = False
        self._end_lost = False
        self._link: dict[str, Fault] = {}

    @property
    def dead(self) -> bool:
        """Whether the instrument takes no part in the bus: no handshake, no poll."""
        return self._clock() < self._dead_until

    @property
    def late(self) -> bool:
        """Whether the reply is being held back."""
        return self._clock() < self._late_until

    def strike(self) -> None:
        """An opportunity: see which faults of instrument and link are due."""
        if fault := self._faults.take("silence"):
            self._dead_until = self._clock() + fault.seconds
        if fault := self._faults.take("lost-power"):
            self._dead_until = self._clock() + fault.seconds
            self._power_failed = True
        if self._faults.take("stuck-parser"):
            self._parser_stuck = True
        for name in _LINK_FAULTS:
            if fault := self._faults.take(name):
                self._link[name] = fault

    def power_failed(self) -> bool:
        """Whether power has failed since the last look."""
        failed, self._power_failed = self._power_failed, False
        return failed

    def fall_silent(self) -> None:
        """For good."""
        self._dead_until = math.inf

    def link_fault(self, name: str) -> Fault | None:
        """A fault that strikes the link, once."""
        return self._link.pop(name, None)

    @property
    def parser_stuck(self) -> bool:
        """Whether the parser hangs until it is freed."""
        return self._parser_stuck

    def free_parser(self) -> None:
        """A device clear frees it."""
        self._parser_stuck = False

    def end_lost(self) -> bool:
        """Whether EOI is missing from the reply that ends now."""
        lost, self._end_lost = self._end_lost, False
        return lost

    def to_reply(self, reply: bytes) -> bytes:
        """A complete reply, damaged if that is due."""
        if fault := self._faults.take("slow-reply"):
            self._late_until = self._clock() + fault.seconds
        self._end_lost = self._faults.take("missing-eoi") is not None
        if reply.startswith(b"#") and (fault := self._faults.take("truncated-block")):
            reply = reply[: max(2, len(reply) - 1 - fault.size)]
        if reply.startswith(b"#") and (fault := self._faults.take("wrong-length")):
            reply = _misstate_length(reply, fault.size)
        if fault := self._faults.take("garbage-bytes"):
            repeats = fault.size // len(_NOISE) + 1
            reply = (_NOISE * repeats)[: fault.size] + reply
        return reply


def _misstate_length(reply: bytes, by: int) -> bytes:
    """A block whose header claims `by` bytes more than follow, in as many digits."""
    digits = int(reply[1:2])
    length = int(reply[2 : 2 + digits])
    claimed = min(length + by, 10**digits - 1)
    return reply[:2] + b"%0*d" % (digits, claimed) + reply[2 + digits :]
