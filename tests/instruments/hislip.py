"""A HiSLIP server for the tests, after IVI-6.1: sessions, status, service requests, clears, locks.

Its instrument is a function of messages, or a simulated one on its bus. It may send service
requests in unfortunate moments, be late with a reply, and break off.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from contextlib import suppress

from daq.transports.hislip import HEADER, Kind, packed
from sim.instrument.pace import Fast

_CHUNK = 700


class Replies:
    """An instrument that is a function from a message to a reply."""

    def __init__(self, reply_to, status_byte=0):
        self.reply_to, self.status_byte = reply_to, status_byte
        self.cleared = 0
        self.service_request = False

    def exchange(self, message):
        return self.reply_to(message.rstrip(b"\n")) or b""

    def poll(self):
        return self.status_byte

    def clear(self):
        self.cleared += 1


class OnBus:
    """A simulated instrument."""

    def __init__(self, box):
        self._box, self._pace = box, Fast(box)

    @property
    def service_request(self):
        return self._box.service_request

    def exchange(self, message):
        self._box.listen(message, end=True)
        self._rest()
        found = bytearray()
        while self._box.reply_ready:
            found += self._box.talk().data
        return bytes(found)

    def poll(self):
        self._rest()
        return self._box.serial_poll()

    def clear(self):
        self._box.device_clear()

    def _rest(self):
        for _ in range(3):
            self._pace.advance()


class HislipServer:
    """Serves on a free port until the block ends."""

    def __init__(self, instrument):
        self.instrument = instrument
        self.late_s = 0.0
        """By how much the next reply is late."""
        self.locked = False
        """Whether another client holds a lock: messages lie there unread."""
        self.requests_before_answers = False
        """Whether a service request comes before each answer to a poll."""
        self._turn = threading.RLock()
        self._asides, self._open, self._threads = {}, [], []
        self._listen(0)

    def _listen(self, port):
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port = self._listener.getsockname()[1]
        self._go(self._accept, self._listener)

    def _go(self, work, *words):
        thread = threading.Thread(target=work, args=words)
        self._threads.append(thread)
        thread.start()

    def _accept(self, listener):
        while True:
            try:
                wire, _ = listener.accept()
            except OSError:
                return
            wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._open.append(wire)
            self._go(self._serve, wire)

    def _serve(self, wire):
        with suppress(OSError, EOFError):
            while True:
                head = _exactly(wire, HEADER.size)
                mark, kind, control, parameter, length = HEADER.unpack(head)
                assert mark == b"HS"
                self._take(wire, kind, control, parameter, _exactly(wire, length))

    def _take(self, wire, kind, control, parameter, payload):
        if kind == Kind.INITIALIZE:
            session = len(self._asides) + 1
            self._asides[session] = None
            wire.sendall(packed(Kind.INITIALIZE_RESPONSE, 0, 0x0100 << 16 | session))
        elif kind == Kind.ASYNC_INITIALIZE:
            self._asides[parameter] = wire
            wire.sendall(packed(Kind.ASYNC_INITIALIZE_RESPONSE))
        elif kind == Kind.ASYNC_MAXIMUM_MESSAGE_SIZE:
            size = struct.pack(">Q", 1 << 16)
            wire.sendall(packed(Kind.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, 0, 0, size))
        elif kind == Kind.DATA_END:
            self._message(wire, parameter, payload)
        elif kind == Kind.ASYNC_STATUS_QUERY:
            with self._turn:
                status = self.instrument.poll()
            if self.requests_before_answers:
                wire.sendall(packed(Kind.ASYNC_SERVICE_REQUEST, status | 64))
            wire.sendall(packed(Kind.ASYNC_STATUS_RESPONSE, status))
        elif kind == Kind.ASYNC_DEVICE_CLEAR:
            with self._turn:
                self.instrument.clear()
            wire.sendall(packed(Kind.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE))
        elif kind == Kind.DEVICE_CLEAR_COMPLETE:
            wire.sendall(packed(Kind.DEVICE_CLEAR_ACKNOWLEDGE))
        elif kind == Kind.ASYNC_LOCK_INFO:
            wire.sendall(packed(Kind.ASYNC_LOCK_INFO_RESPONSE, int(self.locked), 1))

    def _message(self, wire, number, payload):
        while self.locked:
            time.sleep(0.005)
        with self._turn:
            was = self.instrument.service_request
            reply = self.instrument.exchange(payload)
            wants = self.instrument.service_request and not was
        late, self.late_s = self.late_s, 0.0
        time.sleep(late)
        if wants:
            for aside in self._asides.values():
                with suppress(OSError, AttributeError):
                    aside.sendall(packed(Kind.ASYNC_SERVICE_REQUEST, 64))
        while reply:
            part, reply = reply[:_CHUNK], reply[_CHUNK:]
            wire.sendall(packed(Kind.DATA if reply else Kind.DATA_END, 0, number, part))

    def restart(self, away_s=0.0):
        """Break every connection; listen again at the same port a little later."""
        self._hang_up()
        time.sleep(away_s)
        self._listen(self.port)

    def _hang_up(self):
        for wire in (self._listener, *self._open):
            with suppress(OSError):
                wire.shutdown(socket.SHUT_RDWR)
            wire.close()
        self._open.clear()
        self._asides.clear()
        for thread in self._threads:
            thread.join()
        self._threads.clear()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.locked = False
        self._hang_up()


def _exactly(wire, count):
    data = b""
    while len(data) < count:
        part = wire.recv(count - len(data))
        if not part:
            raise EOFError
        data += part
    return data
