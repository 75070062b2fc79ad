"""The message exchange: input queue, parser, output queue, and the errors between them.

Owns the two queues with their real depths and the protocol of IEEE 488.2 for
query errors. It executes nothing itself and knows no command.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from sim.analyser35670a.commands.registry import Answer, Hold, Later
from sim.analyser35670a.commands.tokens import Assembler, Unit
from sim.analyser35670a.errors import ScpiError
from sim.instrument.bus import Talk, TalkState

__all__ = ["INPUT_QUEUE_BYTES", "Exchange"]

INPUT_QUEUE_BYTES = 128
JOINED_REPLY_BYTES = 256
"""[S] Size of a joined reply at which the parser waits for it to be read before the next query."""


class Exchange:
    """Both queues of one instrument.

    Parameters
    ----------
    run
        Executes one unit; raises `ScpiError` where it is refused.
    report
        Takes the number and detail of an error.
    is_query
        Whether a unit will be answered.
    new_message
        Called at the first unit of each message.
    """

    def __init__(
        self,
        run: Callable[[bytes], Answer],
        report: Callable[[int, str], None],
        is_query: Callable[[bytes], bool],
        new_message: Callable[[], None],
    ) -> None:
        self._run, self._report = run, report
        self._is_query, self._new_message = is_query, new_message
        self._input: deque[tuple[int, bool]] = deque()
        self._assembler = Assembler()
        self._output = bytearray()
        self._complete = False
        self._later: Later | None = None
        self._hold: Hold | None = None
        self._waiting_unit: Unit | None = None
        self._discard = False
        self._fresh = True
        self.on_reply: Callable[[bytes], bytes] = bytes
        """Last touch to a complete reply; faults damage it here."""

    # What the bus sees

    @property
    def has_reply(self) -> bool:
        """Message available: a reply stands in the output queue."""
        return bool(self._output)

    @property
    def held(self) -> bool:
        """Whether the parser waits for something."""
        return self._hold is not None or self._later is not None or self._full

    @property
    def idle(self) -> bool:
        """Whether nothing is queued, under way or waited for."""
        return not (self._input or self.held or self._output or self._assembler.in_message)

    @property
    def _full(self) -> bool:
        return self._waiting_unit is not None

    def listen(self, data: bytes, end: bool) -> int:
        """Take bytes off the bus, as many as there is room for; how many that was."""
        taken = 0
        for index, byte in enumerate(data):
            if len(self._input) >= INPUT_QUEUE_BYTES:
                self.pump()
                self._resolve_deadlock()
            if len(self._input) >= INPUT_QUEUE_BYTES:
                break
            self._input.append((byte, end and index == len(data) - 1))
            taken += 1
        self.pump()
        return taken

    def talk(self, limit: int | None = None) -> Talk:
        """Send bytes of the reply, at most `limit`."""
        self.pump()
        if self._output and (self._complete or self._full):
            data = bytes(self._output[:limit])
            del self._output[: len(data)]
            end = self._complete and not self._output
            if end:
                self._complete = False
            self.pump()
            return Talk(TalkState.DATA, data, end)
        if self.held or self._input:
            return Talk(TalkState.WAITING)
        # Nobody asked, or the question has not been finished: both end alike.
        self._assembler.clear()
        self._output.clear()
        self._fresh = True
        self._report(-420, "")
        return Talk(TalkState.NOTHING)

    def clear(self) -> None:
        """Device clear, power-on: both queues and the parser."""
        self._input.clear()
        self._assembler.clear()
        self._drop_reply()
        self._hold = None
        self._waiting_unit = None
        self._discard = False
        self._fresh = True

    def cancel_query(self) -> None:
        """Give up a reply that is due later; the parser goes on."""
        self._later = None

    # The parser

    def pump(self) -> None:
        """Let the parser do what it can."""
        while self._can_go_on() and self._input:
            byte, end = self._input.popleft()
            started = self._assembler.in_message
            unit = self._assembler.feed(byte, end)
            begun = self._assembler.in_message or unit is not None
            if begun and not started and not self._discard:
                self._begin_message()
            if unit is not None:
                self._take(unit)

    def _can_go_on(self) -> bool:
        if self._hold is not None:
            if not self._hold.over():
                return False
            self._hold = None
        if self._later is not None:
            return self._try_later()
        if self._waiting_unit is not None:
            if self._output:
                return False
            unit, self._waiting_unit = self._waiting_unit, None
            self._take(unit)
            return self._can_go_on()
        return True

    def _try_later(self) -> bool:
        """See whether a late reply is ready, or is interrupted by a new message."""
        later = self._later
        if later is None:
            return True
        reply = later.ready()
        if reply is not None:
            self._later = None
            self._append(reply.encode("ascii"), self._fresh)
            return True
        # Within one message the next unit waits; a new message interrupts.
        return self._fresh and any(byte > 32 for byte, _end in self._input)

    def _begin_message(self) -> None:
        if self._output or self._later is not None:
            self._drop_reply()
            self._report(-410, "")
        self._fresh = False
        self._new_message()

    def _take(self, unit: Unit) -> None:
        if self._discard:
            self._discard = not unit.last
            self._fresh = unit.last
            return
        if len(self._output) >= JOINED_REPLY_BYTES and self._is_query(unit.text):
            self._waiting_unit = unit
            return
        self._fresh = unit.last
        try:
            answer = self._run(unit.text)
        except ScpiError as error:
            self._report(error.number, error.detail)
            answer = None
        if isinstance(answer, Hold):
            self._hold = answer
        elif isinstance(answer, Later):
            self._later = answer
            self._try_later()
            return
        elif answer is not None:
            data = answer if isinstance(answer, bytes) else answer.encode("ascii")
            self._append(data, unit.last)
            return
        if unit.last and self._output:
            self._finish_reply()

    def _append(self, data: bytes, last: bool) -> None:
        self._output += (b";" if self._output else b"") + data
        if last:
            self._finish_reply()

    def _finish_reply(self) -> None:
        self._output = bytearray(self.on_reply(bytes(self._output) + b"\n"))
        self._complete = True

    def _drop_reply(self) -> None:
        self._output.clear()
        self._complete = False
        self._later = None

    def _resolve_deadlock(self) -> None:
        """Input full while the parser waits for the output to be read: neither can move."""
        if len(self._input) < INPUT_QUEUE_BYTES or not (self._full and self._output):
            return
        unit = self._waiting_unit
        self._waiting_unit = None
        self._input.clear()
        self._assembler.clear()
        self._drop_reply()
        self._discard = unit is None or not unit.last
        self._fresh = not self._discard
        self._report(-430, "")
