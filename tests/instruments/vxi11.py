"""A small VXI-11 server for the tests, after the VXI-11 and RFC 5531 texts: one link, no abort."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

from sim.instrument.pace import Fast

IO_TIMEOUT = 15
CREATE_LINK, WRITE, READ, READ_STB, CLEAR, DESTROY_LINK = 10, 11, 12, 13, 15, 23


class Vxi11Instrument:
    """Answers remote procedure calls of bytes by bytes; `reply_to` takes a whole message."""

    def __init__(self, reply_to: Callable[[bytes], bytes | None], status_byte: int = 0) -> None:
        self.reply_to = reply_to
        self.status_byte = status_byte
        self.messages: list[bytes] = []
        self.cleared = 0
        self.largest_read = 1 << 20
        self.abort_port = 0
        self.errors: dict[int, int] = {}
        """Error number that a procedure is answered with instead of being done."""
        self._message = b""
        self._reply = b""
        self._bytes = bytearray()

    def feed(self, data: bytes) -> bytes:
        """Bytes of the TCP stream in, bytes out: records of one fragment each."""
        self._bytes += data
        out = b""
        while len(self._bytes) >= 4:
            length = struct.unpack(">I", self._bytes[:4])[0] & 0x7FFFFFFF
            if len(self._bytes) < 4 + length:
                break
            call = bytes(self._bytes[4 : 4 + length])
            del self._bytes[: 4 + length]
            answer = self._call(call)
            out += struct.pack(">I", 0x80000000 | len(answer)) + answer
        return out

    def _call(self, call: bytes) -> bytes:
        xid, kind, rpc, _program, _version, procedure = struct.unpack(">6I", call[:24])
        assert (kind, rpc) == (0, 2)
        body = call[24:]
        for _ in range(2):  # credential and verifier, both empty
            (length,) = struct.unpack(">I", body[4:8])
            body = body[8 + length :]
        accepted = struct.pack(">6I", xid, 1, 0, 0, 0, 0)
        return accepted + self._procedure(procedure, body)

    def _procedure(self, procedure: int, body: bytes) -> bytes:
        if (error := self.errors.get(procedure)) is not None:
            return struct.pack(">2I", error, 0)[: 4 if procedure == CLEAR else 8]
        if procedure == CREATE_LINK:
            return struct.pack(">4I", 0, 7, self.abort_port, 1024)
        if procedure == WRITE:
            flags, size = struct.unpack(">12xII", body[:20])
            self._message += body[20 : 20 + size]
            if flags & 8:  # END
                message, self._message = self._message.rstrip(b"\n"), b""
                self.messages.append(message)
                self._reply = self.reply_to(message) or b""
            return struct.pack(">2I", 0, size)
        if procedure == READ:
            (wanted,) = struct.unpack(">4xI", body[:8])
            if not self._reply:
                return struct.pack(">3I", IO_TIMEOUT, 0, 0)
            cut = min(wanted, self.largest_read)
            data, self._reply = self._reply[:cut], self._reply[cut:]
            reason = 0 if self._reply else 4  # END
            padding = b"\0" * (-len(data) % 4)
            return struct.pack(">3I", 0, reason, len(data)) + data + padding
        if procedure == READ_STB:
            return struct.pack(">2I", 0, self.status_byte)
        if procedure == CLEAR:
            self.cleared += 1
            self._reply = b""
            return struct.pack(">I", 0)
        assert procedure == DESTROY_LINK
        return struct.pack(">I", 0)


class Gateway(Vxi11Instrument):
    """A LAN gateway with a simulated instrument on its bus."""

    def __init__(self, box, **lacking):
        super().__init__(self._exchange)
        vars(self).update(lacking)
        self._box, self._pace = box, Fast(box)

    def _exchange(self, message):
        self._box.listen(message, end=True)
        self._rest()
        found = bytearray()
        while self._box.reply_ready:
            found += self._box.talk().data
        return bytes(found)

    def _rest(self):
        for _ in range(3):
            self._pace.advance()

    def _procedure(self, procedure, body):
        self._rest()
        if procedure == READ_STB and not self.errors.get(READ_STB):
            return struct.pack(">2I", 0, self._box.serial_poll())
        if procedure == CLEAR and not self.errors.get(CLEAR):
            self._box.device_clear()
        return super()._procedure(procedure, body)


class RestartingGateway(Gateway):
    """A gateway that starts anew in a sweep: it hangs up, and for a while on everybody."""

    def __init__(self, box, away_s, point=3):
        super().__init__(box)
        self._away_s, self._point = away_s, point
        self._back_s: float | None = None

    def feed(self, data):
        if self._back_s is None and self._box.points_begun >= self._point:
            self._back_s = time.monotonic() + self._away_s
        if self._back_s is not None and time.monotonic() < self._back_s:
            self._bytes.clear()
            self._message, self._reply = b"", b""
            return None
        return super().feed(data)
