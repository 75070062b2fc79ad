"""A file system that stops answering, for one process and its children, without privileges.

The kernel hands every call that would reach a file to a supervisor here (seccomp user
notification), which lets it through at once, or holds it for as long as the folder is frozen. A
process that waits so hangs in the system call, as it does on a network share whose server is
gone. Linux 5.5 and newer, x86-64 and arm64.
"""

from __future__ import annotations

import array
import ctypes
import errno
import fcntl
import os
import platform
import select
import socket
import struct
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

_CALLS = {
    "x86_64": {"write": 1, "pwrite64": 18, "fsync": 74, "fdatasync": 75, "ftruncate": 77,
               "openat": 257, "unlink": 87, "unlinkat": 263},
    "aarch64": {"write": 64, "pwrite64": 68, "fsync": 82, "fdatasync": 83, "ftruncate": 46,
                "openat": 56, "unlinkat": 35},
}  # fmt: skip
_BY_PATH = {"openat": 1, "unlink": 0, "unlinkat": 1}
"""Which argument is the path; the others have a descriptor first."""
_AUDIT_SECCOMP = {"x86_64": 317, "aarch64": 277}
_PR_SET_NO_NEW_PRIVS, _MODE_FILTER, _NEW_LISTENER = 38, 1, 1 << 3
_ALLOW, _NOTIFY = 0x7FFF0000, 0x7FC00000
_RECEIVE, _ANSWER, _STILL_THERE = 0xC0502100, 0xC0182101, 0x40082102
_GO_ON = 1

_LAUNCHER = """
import sys
sys.path.insert(0, {here!r})
from worlds.frozen_files import run_held
run_held({channel}, sys.argv[1:])
"""


def can_be_held() -> bool:
    """Whether this machine can do it."""
    return sys.platform == "linux" and platform.machine() in _CALLS


def run_held(channel: int, command: list[str]) -> None:
    """Become a program whose calls go through the supervisor at the other end of a socket."""
    with socket.socket(fileno=channel) as wire:
        hold(wire)
    os.execvp(command[0], command)


def hold(wire: socket.socket) -> None:
    """From now on the calls of this thread, and of all it starts, go through the supervisor."""
    libc = ctypes.CDLL(None, use_errno=True)
    numbers = sorted(set(_CALLS[platform.machine()].values()))
    jumps = [
        struct.pack("HBBI", 0x15, len(numbers) - place, 0, number)
        for place, number in enumerate(numbers)
    ]
    code = b"".join(
        [
            struct.pack("HBBI", 0x20, 0, 0, 0),  # load the number of the call
            *jumps,
            struct.pack("HBBI", 0x06, 0, 0, _ALLOW),
            struct.pack("HBBI", 0x06, 0, 0, _NOTIFY),
        ]
    )
    text = ctypes.create_string_buffer(code, len(code))
    program = struct.pack("HxxxxxxP", len(code) // 8, ctypes.addressof(text))
    if libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0):
        sys.exit("prctl")
    # Sent by a thread that the filter does not hold, which comes before it.
    listener: list[int] = []
    installed = threading.Event()

    def hand_over() -> None:
        installed.wait()
        wire.sendmsg([b"x"], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", listener))])

    thread = threading.Thread(target=hand_over)
    thread.start()
    buffer = ctypes.create_string_buffer(program, len(program))
    number = _AUDIT_SECCOMP[platform.machine()]
    found = libc.syscall(number, _MODE_FILTER, _NEW_LISTENER, buffer)
    if found < 0:
        os._exit(99)
    listener.append(found)
    installed.set()
    thread.join()
    os.close(found)


class Freezer:
    """Holds calls that reach a folder, while it is frozen."""

    def __init__(self, folder: Path, listener: int) -> None:
        self._folder = os.path.realpath(folder)
        self._listener = listener
        self._names = {number: name for name, number in _CALLS[platform.machine()].items()}
        self._frozen = threading.Event()
        self._held: list[int] = []
        self._lock = threading.Lock()
        self._over = False
        self._only: tuple[str, ...] = ()
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    @property
    def holds(self) -> int:
        """Calls that hang now."""
        with self._lock:
            return len(self._held)

    def freeze(self, *names: str) -> None:
        """From now on nothing in the folder answers, or none of the calls that are named."""
        self._only = names
        self._frozen.set()

    def thaw(self) -> None:
        """All that waited goes on."""
        with self._lock:
            self._frozen.clear()
            held, self._held = self._held, []
        for cookie in held:
            self._answer(cookie)

    def end(self) -> None:
        self._over = True
        self.thread.join(5)
        os.close(self._listener)

    def _serve(self) -> None:
        poll = select.poll()
        poll.register(self._listener, select.POLLIN)
        while not self._over:
            ready = poll.poll(50)
            if not ready:
                continue
            if ready[0][1] & (select.POLLHUP | select.POLLERR) and not ready[0][1] & select.POLLIN:
                return
            asked = bytearray(80)
            try:
                fcntl.ioctl(self._listener, _RECEIVE, asked)
            except OSError as error:
                if error.errno in (errno.ENOENT, errno.EINTR):
                    continue
                return
            cookie, process, _flags, number = struct.unpack_from("=QIIi", asked)
            arguments = struct.unpack_from("=6Q", asked, 32)
            with self._lock:
                if self._frozen.is_set() and self._is_inside(process, number, arguments):
                    self._held.append(cookie)
                    continue
            self._answer(cookie)

    def _answer(self, cookie: int) -> None:
        with suppress(OSError):
            answer = bytearray(struct.pack("=QqiI", cookie, 0, 0, _GO_ON))
            fcntl.ioctl(self._listener, _ANSWER, answer)

    def _is_inside(self, process: int, number: int, arguments: tuple[int, ...]) -> bool:
        name = self._names[number]
        if self._only and name not in self._only:
            return False
        with suppress(OSError):
            if name in _BY_PATH:
                with open(f"/proc/{process}/mem", "rb", buffering=0) as memory:
                    memory.seek(arguments[_BY_PATH[name]])
                    path = os.fsdecode(memory.read(4096).partition(b"\0")[0])
            else:
                path = os.readlink(f"/proc/{process}/fd/{arguments[0]}")
            return path.startswith(self._folder)
        return False


def freezer_of(wire: socket.socket, folder: Path) -> Freezer:
    """What freezes the files of the program at the other end, which is about to `hold`."""
    _, rights, _, _ = wire.recvmsg(1, socket.CMSG_SPACE(4))
    return Freezer(folder, array.array("i", rights[0][2])[0])


@contextmanager
def started(command: list[str], folder: Path, **options):
    """A program whose files in a folder can be frozen: the process, and what freezes them."""
    near, far = socket.socketpair()
    here = str(Path(__file__).parents[1])
    launcher = _LAUNCHER.format(here=here, channel=far.fileno())
    process = subprocess.Popen(
        [sys.executable, "-c", launcher, *command], pass_fds=(far.fileno(),), **options
    )
    far.close()
    freezer = freezer_of(near, folder)
    near.close()
    try:
        yield process, freezer
    finally:
        freezer.thaw()
        if process.poll() is None:
            process.kill()
        process.wait()
        freezer.end()
