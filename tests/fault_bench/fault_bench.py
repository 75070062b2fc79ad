"""What a run of the fault campaign is made of: the measuring program, and the served instrument.

Both are only held here: started, listened to, unplugged, ended. Nothing is
judged.
"""

from __future__ import annotations

import multiprocessing
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from fault_bench import fault_child
from instruments.bench_server import GATEWAYS
from instruments.bench_server import url as url_of

from sim.serve import Server


def starved_s(process: int) -> float:
    """How long a process or thread was ready to run and got no processor; 0.0 once it is gone."""
    with suppress(OSError):
        return int(Path(f"/proc/{process}/schedstat").read_text(encoding="ascii").split()[1]) / 1e9
    return 0.0


class Programs:
    """Where measuring programs come from: a fork server that has everything imported."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(["fault_bench.fault_child"])

    def start(self, *words: Any) -> Child:
        """A measuring program; the words are those of `fault_child.measure`."""
        near, far = self._context.Pipe(duplex=False)
        process = self._context.Process(target=fault_child.measure, args=(far, *words))
        process.start()
        far.close()
        return Child(process, near)


class Child:
    """A measuring program and what it told."""

    def __init__(self, process: Any, pipe: Any) -> None:
        self.process = process
        self.pipe = pipe
        self.pid = 0
        self.measurement = 0
        self.told: list[tuple[int, float, float, complex, int]] = []
        self.verdict: dict[str, Any] | None = None

    def listen(self, wait_s: float) -> bool:
        """Take one record; whether more may come."""
        try:
            if not self.pipe.poll(wait_s):
                return True
            kind, content = self.pipe.recv()
        except (EOFError, OSError):
            return False
        if kind == "started":
            self.pid = content
        elif kind == "opened":
            self.measurement = content
        elif kind == "told":
            self.told.append(content)
        else:
            self.verdict = content
        return True

    def starved_s(self) -> float:
        """How long it, or its watchdog where that is longer, has waited for a processor."""
        if not self.pid:
            return starved_s(self.process.pid or 0)
        with suppress(OSError):
            watchdogs = fault_child.children_of(self.pid)
            return max(starved_s(process) for process in (self.pid, *watchdogs))
        return 0.0

    def end(self) -> None:
        """Gone, and its pipe closed."""
        if self.process.is_alive():
            self.process.join(2.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.pipe.close()
        self.process.close()


class Served:
    """A server of the instrument in a thread, which can be unplugged."""

    def __init__(self, instrument: Any, wire: str, driver: str = "") -> None:
        name = "prologix_pty" if wire == "ar488_pty" else wire
        ports: dict[str, Any] = {"tcp": 0}
        if name in ("prologix_tcp", *GATEWAYS):
            ports[name] = 0
        if name == "prologix_pty":
            ports["prologix_pty"] = True
        if name == "serial_pty":
            ports["serial_pty"] = instrument
        dialect = "ar488" if wire == "ar488_pty" else "prologix"
        self._server = Server(instrument, realtime=False, dialect=dialect, **ports)
        self.url = url_of(name, self._server.addresses[name], driver)
        host, port = self._server.addresses["tcp"].split(":")
        self.raw = host, int(port)
        self._thread: threading.Thread | None = threading.Thread(target=self._server.run)
        self._thread.start()

    def starved_s(self) -> float:
        """How long the instrument has waited for a processor."""
        thread = self._thread
        return 0.0 if thread is None else starved_s(thread.native_id or 0)

    def unplug(self) -> None:
        """Nobody is there any more; may be called twice."""
        if self._thread is not None:
            self._server.stop()
            self._thread.join()
            self._server.close()
            self._thread = None
