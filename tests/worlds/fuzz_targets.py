"""Everything that reads what others wrote, as functions of bytes; for the fuzzer and the tests.

A target takes any bytes. It returns if they were read, or refused as promised,
and raises on anything else: another exception, a refusal with the wrong exit
code or in several lines, a parser that does not come back to its senses.
`seeds` gives whole examples to start from. Files carry a digest that random
bytes never fit, so the digest is switched off here: what lies behind it is to
be reached. HDF5 and SDF files are read in this process, where coverage is seen; MATLAB files
as users read them, in a child process, because scipy crashes on some.
"""

from __future__ import annotations

import hashlib
import os
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from foreign_files import NAMED, arrays, dtt_xml, files, universal_58, universal_58b
from instruments.wire import MemoryLink, TinyAdapter
from scipy.io import savemat, wavfile
from worlds.responses import measured
from worlds.sdf_files import File

from daq.configs import config_path
from daq.driving.replies import decode_reals, parse_error, parse_integer, parse_number, parse_string
from daq.errors import BenchTimeout, InputError, LashbenchError, LinkError, ProtocolError
from daq.formats import Reading, hdf5, read_response, record, sdf, write_response
from daq.formats.foreign import dtt
from daq.limits import load_bench
from daq.recipe import load_recipe
from daq.store import Store
from daq.time_records.columns import read_record
from daq.time_records.record import TimeRecord
from daq.transports.address import parse_address
from daq.transports.base import Deadline, ask, ask_block, take_block
from daq.transports.prologix import PrologixTransport
from daq.transports.prologix_adapter import Adapter
from daq.transports.transcript import Replay
from sim.analyser35670a import Analyser35670A, Choices
from sim.instrument.gpib_adapter import FakeAdapter
from sim.instrument.gpib_dialects import AR488, PROLOGIX_USB
from sim.instrument.plant import LinearPlant
from sim.unit import load_unit
from tui.measurements.history_rows import measurement_row

Target = Callable[[bytes], Any]

_SHORT_S = 0.002
_HISTORY = Path(__file__).parents[1] / "data" / "history-v1.sql"
_MEMORY = Path("/dev/shm")


@contextmanager
def targets() -> Iterator[dict[str, Target]]:
    """All targets by name, in a folder that goes with the block."""
    honest, record._digest = record._digest, lambda *_: "0" * 64
    place = _MEMORY if os.access(_MEMORY, os.W_OK) else None
    try:
        with tempfile.TemporaryDirectory(prefix="fuzz-", dir=place) as folder:
            yield _targets(Path(folder))
    finally:
        record._digest = honest


def _targets(folder: Path) -> dict[str, Target]:
    def file(name: str, read: Callable[[Path], Any]) -> Target:
        return lambda data: read_file(folder / name, data, read)

    return {
        "csv": file("x.csv", read_response),
        "hdf5": file("x.h5", hdf5.read),
        "uff": file("x.uff", read_response),
        "foreign-uff": file("x.unv", lambda path: read_response(path, Reading(function="1"))),
        "text": file("x.txt", read_response),
        "guess": file("x.asc", lambda path: read_response(path, Reading(as_guessed=True))),
        "dtt": file("x.xml", dtt.read),
        "foreign-mat": file("y.mat", lambda path: read_response(path, NAMED)),
        "foreign-h5": file("y.h5", lambda path: read_response(path, NAMED)),
        "record": file("r.csv", read_sampled),
        "record-mat": file("r.mat", read_sampled),
        "record-wav": file("r.wav", lambda path: read_record(path, "1", "2")),
        "mat": lambda data: read_file(folder / "x.mat", with_its_digest(data), read_response),
        "sdf": file("x.sdf", sdf.read),
        "unit": file("unit.toml", lambda path: load_unit(str(path))),
        "bench": file("bench.toml", lambda path: load_bench(str(path))),
        "recipe": file("recipe.toml", lambda path: load_recipe(str(path))),
        "transcript": file("x.jsonl", read_transcript),
        "history": file("x.db", read_history),
        "block": read_block,
        "replies": read_replies,
        "address": read_address,
        "prologix": talk_through_adapter,
        "analyser": talk_to_analyser,
        "adapter": talk_to_adapter,
    }


def seeds(name: str) -> list[bytes]:
    """Whole examples of what a target reads; made with the digest switched off."""
    suffix = {"csv": ".csv", "hdf5": ".h5", "uff": ".uff", "mat": ".mat"}.get(name)
    if suffix is not None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"x{suffix}"
            write_response(measured(flags=None), path)
            return [path.read_bytes()]
    if name in ("text", "guess"):
        return [_head(file.content) for file in files()]
    if name == "dtt":
        return [dtt_xml(listed) for listed in (True, False)]
    if name.startswith("foreign-") and name != "foreign-uff":
        return [arrays(name.removeprefix("foreign-"))]
    if name.startswith("record"):
        return [_recorded(name)]
    if name == "foreign-uff":
        return [universal_58(), universal_58b()]
    if name in ("unit", "bench", "recipe"):
        kind: Any = {"unit": "units", "bench": "benches", "recipe": "recipes"}[name]
        return [config_path(kind, "default" if name == "bench" else "adss").read_bytes()]
    if name == "history":
        return [_history()]
    return {"sdf": [File().content(), File(y_code=4).content()], **_SMALL}[name]


_SMALL = {
    "transcript": [
        b'{"transcript": 1, "address": "sim:", "started": "2026-11-21", "t_s": 0.0}\n'
        b'{"act": "write", "line": "A?", "t_s": 0.1}\n{"act": "read", "gave": "+5", "t_s": 0.2}\n'
        b'{"act": "block", "base64": "AAAA", "t_s": 0.3}\n{"act": "poll", "gave": 96, "t_s": 1}\n'
        b'{"act": "clear", "gave": true, "t_s": 2}\n'
        b'{"act": "read", "raised": "BenchTimeout", "message": "late", "t_s": 3}\n'
    ],
    "block": [b"#15hello\n", b"#3008\0\0\0\0\0\0\0\0\n"],
    "replies": [b"+1.5E+003", b'-113,"Undefined header;X"', b"'text'", b"+256"],
    "address": [
        b"TCPIP::127.0.0.1::5025::SOCKET", b"GPIB0::11::INSTR", b"sim:?ratio=0.3&seed=1",
        b"prologix:/dev/ttyUSB0?addr=11", b"prologix-tcp:h:1234?addr=11", b"replay:x.jsonl",
    ],
    "prologix": [
        b"\x01#15hello\n", b"\x01+5\n", b"\x00Prologix GPIB-USB Controller version 6.107\n11\n"
    ],
    "analyser": [
        b"*IDN?\n", b"INST:SEL SINE;:SOUR:VOLT 1 VPK\nINIT\n", b"CALC1:DATA?\n",
        b"FREQ:STAR 100;STOP 200\nSYST:ERR?\n", b"SYST:SET?\n", b"TRAC:DATA D1,#15hello\n",
    ],
    "adapter": [
        b"++savecfg 0\n++addr 11\n++auto 0\n++eoi 1\n++eos 3\n++read_tmo_ms 1000\n",
        b"++addr 11\n*IDN?\n++read eoi\n", b"++spoll\n++clr\n++ver\n", b"\x1b\x1b\x1b+\x1b\n",
    ],
}  # fmt: skip


def read_file(path: Path, data: bytes, read: Callable[[Path], Any]) -> None:
    """Read as a file: whole, or refused with exit code 2 in one line that names it."""
    path.write_bytes(data)
    try:
        read(path)
    except InputError as error:
        told = str(error)
        if "\n" in told or str(path) not in told:
            raise AssertionError(f"a refusal that is no line naming the file: {told!r}") from error


def read_sampled(path: Path) -> TimeRecord:
    """A record whose file does not say its rate."""
    return read_record(path, "1", "2", rate_hz=1000.0)


def _recorded(name: str) -> bytes:
    """A record of two columns of 70 samples."""
    rows = np.random.default_rng(1).normal(size=(70, 2)).round(3)
    held = BytesIO()
    if name == "record":
        np.savetxt(held, rows, delimiter=",", header="V_i,V_o", comments="", fmt="%g")
    elif name == "record-mat":
        savemat(held, {"data": rows})
    else:
        wavfile.write(held, 1000, (rows * 8000).astype(np.int16))
    return held.getvalue()


def _head(content: bytes) -> bytes:
    """The first lines of a table, which are as good as all; UTF-16 stays whole."""
    return content if content[:1] == b"\xff" else b"\n".join(content.split(b"\n")[:40])


def with_its_digest(data: bytes) -> bytes:
    """A MATLAB file with the digest at its head that fits the rest, as anybody can write it."""
    mark = f"MATLAB 5.0 MAT-file, lashbench, sha256 {hashlib.sha256(data[116:]).hexdigest()}"
    return mark.ljust(116).encode("ascii") + data[116:]


def read_transcript(path: Path) -> None:
    """Read a recording, and play all of it."""
    replay = Replay(path)
    acts = (replay.read, replay.read_block, replay.serial_poll, replay.device_clear)
    for _ in range(min(replay.unused, 20)):
        before = replay.unused
        for act in acts:
            with suppress(LashbenchError):
                act(Deadline.after(1.0))
            if replay.unused < before:
                break


def read_history(path: Path) -> None:
    """Read all that a history holds; nothing beside it is left."""
    try:
        with Store(path, read_only=True) as store:
            for line in store.each_line():
                measurement_row(line)
                store.corrections(line.id)
                store.estimate_in_force(line.id)
                store.diagnoses_in_force(line.id)
            for measurement in store.measurements():
                store.points(measurement.id, superseded=True)
                store.events(measurement.id)
                if measurement.points:
                    store.response(measurement.id)
            store.latest_estimates()
    finally:
        for beside in path.parent.glob(f"{path.name}-*"):
            beside.unlink()


def read_block(data: bytes) -> None:
    """A block from a wire that ends somewhere."""
    rest = bytearray(data)

    def take(count: int) -> bytes:
        if count > 1 << 20:
            raise AssertionError(f"{count} bytes were asked for")
        if count > len(rest):
            raise ProtocolError("no more bytes")
        part = bytes(rest[:count])
        del rest[:count]
        return part

    with suppress(ProtocolError):
        decode_reals(take_block(take))


def read_replies(data: bytes) -> None:
    """A reply as any of the kinds that there are."""
    text = data.decode("latin-1")
    for parse in (parse_number, parse_integer, parse_error, parse_string):
        with suppress(ProtocolError):
            parse(text)


def read_address(data: bytes) -> None:
    """What a person gives as --instrument."""
    with suppress(InputError):
        parse_address(data.decode("utf-8", "surrogateescape"))


class _Babble:
    """An adapter that says the given bytes, whatever it is asked."""

    name = "babble"

    def __init__(self, data: bytes) -> None:
        self._pieces = [data[start : start + 40] for start in range(0, len(data), 40)]

    def send(self, data: bytes, deadline: Deadline) -> None:
        """Not listened to."""

    def receive(self, deadline: Deadline) -> bytes:
        return self._pieces.pop(0) if self._pieces else b""

    def close(self) -> None:
        """Nothing to close."""


def talk_through_adapter(data: bytes) -> None:
    """Our side of an adapter: the bytes are the adapter's own, or an instrument's reply."""
    with suppress(LinkError, BenchTimeout):
        if data[:1] == b"\x00":
            Adapter(_Babble(data[1:]), 11, Deadline.after(_SHORT_S))
            return
        tiny = TinyAdapter(lambda _: data[1:])
        transport = PrologixTransport(
            Adapter(MemoryLink(tiny), 11, Deadline.after(1.0)), "prologix:"
        )
        for question in (ask, ask_block):
            with suppress(LinkError, BenchTimeout):
                question(transport, "X?", Deadline.after(_SHORT_S))
            transport.device_clear(Deadline.after(_SHORT_S))


def talk_to_analyser(data: bytes) -> None:
    """Messages to the simulated analyser, which must answer like new afterwards."""
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.1), Choices())
    for line in data.split(b"\n")[:20]:
        rest = line + b"\n"
        for _ in range(8):
            rest = rest[instrument.listen(rest, end=len(line) % 2 == 0) :]
            instrument.agenda.run_next()
            if not rest:
                break
        if b"?" in line:
            instrument.talk(None if len(line) % 3 else 3)
    instrument.device_clear()
    instrument.agenda.run_until(instrument.agenda.now_s + 100.0)
    instrument.listen(b"*CLS\n")
    instrument.listen(b"SYST:ERR?\n")
    answer = instrument.talk().data
    if answer != b'+0,"No error"\n' and not instrument.damage.dead:
        raise AssertionError(f"after a device clear it says {answer!r}")


def talk_to_adapter(data: bytes) -> None:
    """Bytes to the simulated adapter, which must still know its version afterwards."""
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.1), Choices())
    adapter = FakeAdapter(instrument, AR488 if data[:1] == b"\x00" else PROLOGIX_USB, restart_s=0.0)
    now_s = 0.0
    for start in range(0, min(len(data), 4000), 50):
        adapter.receive(data[start : start + 50], now_s)
        adapter.take_output(now_s)
        now_s += 0.5
    for _ in range(20):
        now_s += 1.0
        adapter.pump(now_s)
        adapter.take_output(now_s)
    adapter.restart(now_s)
    adapter.receive(b"++ver\n", now_s + 10.0)
    adapter.pump(now_s + 11.0)
    if b"ersion" not in (answer := adapter.take_output(now_s + 12.0)) and b"AR488" not in answer:
        raise AssertionError(f"after a restart it says {answer!r}")


def _history() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.db"
        with closing(sqlite3.connect(path)) as raw:
            raw.executescript(_HISTORY.read_text(encoding="utf-8"))
        Store(path).close()
        return path.read_bytes()
