"""A simulated analyser on a wire: raw TCP, a Prologix-style bridge, LAN gateways, terminals.

Owns the sockets and terminals and the loop that turns all of them, the
adapters and the instrument in one thread. It listens on 127.0.0.1 only, prints
nothing and catches no signal; `stop` may be called from anywhere.
"""

from __future__ import annotations

import os
import selectors
import socket
import time
from collections.abc import Callable
from types import TracebackType

from daq.errors import LinkError
from sim.gateways.hislip import HislipGateway
from sim.gateways.vxi11 import Vxi11Gateway
from sim.instrument.bus import Instrument
from sim.instrument.gpib_adapter import FakeAdapter
from sim.instrument.gpib_dialects import (
    AR488,
    AR488_LATE_EOI,
    PROLOGIX_ETHERNET,
    PROLOGIX_USB,
    Dialect,
)
from sim.instrument.pace import ByTheClock, Fast, Pace
from sim.instrument.serial_line import SerialInstrument, SerialLine
from sim.instrument.server_endpoints import (
    AdapterClient,
    Cable,
    Client,
    Listener,
    RawClient,
    Terminal,
)

__all__ = ["HOST", "Server"]

HOST = "127.0.0.1"
_TICK_S = 0.005
_LIVELY_TICK_S = 0.0005
_IDLE_S = 0.25
_FAST_RESTART_S = 0.2
_ARDUINOS = {"ar488": AR488, "ar488-late-eoi": AR488_LATE_EOI}


class Server:
    """One instrument behind any number of wires.

    Parameters
    ----------
    instrument
        What is served.
    realtime
        By the clock; else as fast as it can be computed.
    tcp, prologix_tcp, vxi11, hislip
        Ports, 0 for any free one, None for none.
    prologix_pty
        Whether to open a pseudo-terminal with an adapter behind it.
    serial_pty
        The instrument again, where a pseudo-terminal is to be its RS-232 interface; else None.
    dialect
        What the pseudo-terminal and the TCP bridge pretend to be: ``"prologix"``, ``"ar488"``, or
        ``"ar488-late-eoi"``, the firmware whose EOI comes after the last byte.

    Raises
    ------
    LinkError
        If a port cannot be had.
    """

    def __init__(
        self,
        instrument: Instrument,
        *,
        realtime: bool = True,
        tcp: int | None = None,
        prologix_tcp: int | None = None,
        vxi11: int | None = None,
        hislip: int | None = None,
        prologix_pty: bool = False,
        serial_pty: SerialInstrument | None = None,
        dialect: str = "prologix",
    ) -> None:
        self.instrument = instrument
        self._pace: Pace = ByTheClock(instrument) if realtime else Fast(instrument)
        self._selector = selectors.DefaultSelector()
        self._wake_read, self._wake_write = os.pipe()
        self._selector.register(self._wake_read, selectors.EVENT_READ)
        self._stopping = False
        self._away_until: float | None = None
        self._cables: list[Cable] = []
        self._listeners: list[Listener] = []
        self._clients: list[Client] = []
        self._terminals: dict[str, Terminal] = {}
        self.addresses: dict[str, str] = {}
        """Where it is served: ``tcp``, ``prologix_tcp``, ``vxi11``, ``hislip``, ``prologix_pty``,
        ``serial_pty``."""
        try:
            if tcp is not None:
                self._listen(
                    "tcp", tcp, lambda wire, place: RawClient(wire, self.instrument, place)
                )
            if prologix_tcp is not None:
                bridge = _ARDUINOS.get(dialect, PROLOGIX_ETHERNET)
                adapter = self._adapter(bridge, realtime)
                self._listen(
                    "prologix_tcp", prologix_tcp, lambda wire, _: AdapterClient(wire, adapter)
                )
            if vxi11 is not None:
                gateway = Vxi11Gateway(instrument)
                self._listen("vxi11", vxi11, lambda wire, _: gateway.core(wire))
                gateway.abort_port = self._listen(None, 0, lambda wire, _: gateway.abort(wire))
            if hislip is not None:
                sessions = HislipGateway(instrument)
                self._listen("hislip", hislip, lambda wire, _: sessions.client(wire))
            if prologix_pty:
                cable = _ARDUINOS.get(dialect, PROLOGIX_USB)
                self._open_terminal("prologix_pty", self._adapter(cable, realtime))
            if serial_pty is not None:
                line = SerialLine(serial_pty) if realtime else SerialLine(serial_pty, baud=0)
                self._cables.append(line)
                self._open_terminal("serial_pty", line)
        except BaseException:
            self.close()
            raise

    def _open_terminal(self, name: str, cable: Cable) -> None:
        self._terminals[name] = terminal = Terminal(cable)
        self.addresses[name] = terminal.path

    def _adapter(self, dialect: Dialect, realtime: bool) -> FakeAdapter:
        adapter = FakeAdapter(
            self.instrument,
            dialect,
            restart_s=None if realtime else _FAST_RESTART_S,
            paced=realtime,
        )
        self._cables.append(adapter)
        return adapter

    def _listen(
        self, name: str | None, port: int, meet: Callable[[socket.socket, Listener], Client]
    ) -> int:
        """Listen on a port, under a name if others are told of it; the port."""
        try:
            wire = socket.create_server((HOST, port))
        except (OSError, OverflowError) as error:
            raise LinkError(
                f"port {port} on {HOST} cannot be listened on ({error}); give another, or 0 "
                "for any free one"
            ) from error
        wire.setblocking(False)
        listener = Listener(wire, meet)
        self._listeners.append(listener)
        self._selector.register(wire, selectors.EVENT_READ, listener)
        found = int(wire.getsockname()[1])
        if name is not None:
            self.addresses[name] = f"{HOST}:{found}"
        return found

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def stop(self) -> None:
        """End `run` soon; safe in a signal handler and from another thread."""
        self._stopping = True
        os.write(self._wake_write, b"x")

    def run(self) -> None:
        """Serve until `stop`."""
        while not self._stopping:
            self.turn(self._wait_s())

    def turn(self, wait_s: float) -> None:
        """One round: what came in, what is due, what goes out."""
        for key, _events in self._selector.select(wait_s):
            if isinstance(key.data, Listener):
                self._accept(key.data)
            elif isinstance(key.data, Client):
                self._pace.touch()
                key.data.gather()
        now_s = time.monotonic()
        for terminal in self._terminals.values():
            if terminal.gather(now_s):
                self._pace.touch()
        self._pace.advance()
        for cable in self._cables:
            cable.pump(now_s)
        self._work_clients(now_s)
        for terminal in self._terminals.values():
            terminal.flush(now_s)
        if self.instrument.damage.link_fault("dropped-connection"):
            self._drop_all(now_s)
        if fault := self.instrument.damage.link_fault("link-away"):
            self._drop_all(now_s, fault.seconds)
        self._come_back(now_s)

    def _work_clients(self, now_s: float) -> None:
        for client in self._clients:
            client.work(now_s)
        for client in [client for client in self._clients if client.closed]:
            self._forget(client)

    def _accept(self, listener: Listener) -> None:
        client = listener.accept()
        if client is not None:
            self._clients.append(client)
            self._selector.register(client.wire, selectors.EVENT_READ, client)

    def _forget(self, client: Client) -> None:
        self._clients.remove(client)
        self._selector.unregister(client.wire)
        client.close()

    def _drop_all(self, now_s: float, away_s: float | None = None) -> None:
        """Break every connection; with `away_s` nobody is there to be connected to for so long."""
        for client in list(self._clients):
            client.reset()
            self._forget(client)
        for name, terminal in self._terminals.items():
            if away_s is None:
                terminal.unplug(now_s)
            else:
                terminal.unplug(now_s, away_s)
            self.addresses[name] = terminal.path
        if away_s is not None:
            gone, self._away_until = self._away_until is not None, now_s + away_s
            for cable in self._cables:
                if isinstance(cable, FakeAdapter):
                    cable.restart(now_s, away_s)
            # A measurement goes on while the gateway is away, and so do faults of the link.
            for listener in () if gone else self._listeners:
                self._selector.unregister(listener.wire)
                listener.leave()

    def _come_back(self, now_s: float) -> None:
        """Listen again where the gateway was away."""
        if self._away_until is None or now_s < self._away_until:
            return
        self._away_until = None
        for listener in self._listeners:
            listener.come_back()
            self._selector.register(listener.wire, selectors.EVENT_READ, listener)

    def _wait_s(self) -> float:
        due = self._pace.wait_s
        wait = _IDLE_S if due is None else min(due, _IDLE_S)
        busy = any(cable.busy for cable in self._cables)
        busy = busy or any(client.waiting for client in self._clients)
        if self._terminals:
            # They are looked at in turns: the selector would spin on one that nobody has open.
            now_s = time.monotonic()
            lively = any(terminal.lively(now_s) for terminal in self._terminals.values())
            return min(wait, _LIVELY_TICK_S if lively else _TICK_S)
        return min(wait, _TICK_S) if busy else wait

    def close(self) -> None:
        """Close every wire."""
        for client in list(self._clients):
            self._forget(client)
        for listener in self._listeners:
            if self._away_until is None:
                self._selector.unregister(listener.wire)
            listener.wire.close()
        self._listeners.clear()
        for terminal in self._terminals.values():
            terminal.close()
        self._terminals.clear()
        if self._wake_read >= 0:
            self._selector.close()
            os.close(self._wake_read)
            os.close(self._wake_write)
            self._wake_read = -1
