"""A PostgreSQL server of its own for a test: made, started, stopped, thrown away.

Its programs are those of the system, or of the package `pgserver`.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

USER, PASSWORD = "bench", "not:a@secret"
SHOWN = "not%3Aa%40secret"
"""The password as an address holds it."""


def programs() -> Path | None:
    """Where `initdb` and `postgres` are; None if there are none."""
    found = shutil.which("initdb")
    if found is not None:
        return Path(found).resolve().parent
    package = find_spec("pgserver")
    if package is not None and package.origin is not None:
        place = Path(package.origin).parent / "pginstall" / "bin"
        return place if (place / "initdb").exists() else None
    return None


class Server:
    """A running server; `stop` and `start` it as often as wanted."""

    def __init__(self, folder: Path, place: Path) -> None:
        self._data, self._place = folder / "data", place
        # The server refuses to run as root.
        self._as = {"user": 65534, "group": 65534, "extra_groups": []} if os.getuid() == 0 else {}
        secret = folder / "secret"
        secret.write_text(PASSWORD, encoding="ascii")
        if self._as:
            for one in (folder, secret):
                os.chown(one, 65534, 65534)
        self._run(
            "initdb", "-D", self._data, "-U", USER, "-A", "scram-sha-256", "-E", "UTF8",
            "--no-locale", "--no-sync", "--no-instructions", f"--pwfile={secret}",
        )  # fmt: skip
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self._process: subprocess.Popen[bytes] | None = None

    def _run(self, name: str, *words: object) -> None:
        command = [str(self._place / name), *map(str, words)]
        subprocess.run(command, check=True, capture_output=True, cwd="/", **self._as)

    def start(self) -> None:
        """Returns when it answers."""
        import psycopg

        command = [self._place / "postgres", "-D", self._data, "-p", str(self.port), "-h",
                   "127.0.0.1", "-k", "", "-F"]  # fmt: skip
        self._process = subprocess.Popen(
            list(map(str, command)), cwd="/", stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, **self._as,
        )  # fmt: skip
        until_s = time.monotonic() + 60.0
        while True:
            try:
                self.sql("postgres", "SELECT 1")
                return
            except psycopg.OperationalError:
                assert time.monotonic() < until_s, "the server does not start"
                time.sleep(0.05)

    def stop(self) -> None:
        """At once, as in a power cut of the service; what was committed is kept."""
        if self._process is not None:
            self._process.send_signal(3)
            self._process.wait()
            self._process = None

    def url(self, database: str, user: str = USER, password: str = SHOWN) -> str:
        """Address of a database."""
        return f"postgresql://{user}:{password}@127.0.0.1:{self.port}/{database}"

    def sql(self, database: str, *statements: str) -> list[tuple[object, ...]]:
        """Run statements as the owner of all; rows of the last, if it has any."""
        import psycopg

        with psycopg.connect(
            host="127.0.0.1", port=self.port, user=USER, password=PASSWORD, dbname=database,
            autocommit=True,
        ) as connection:  # fmt: skip
            for statement in statements:
                done = connection.execute(statement)
            return done.fetchall() if done.description else []


@contextmanager
def running():
    """A server for the length of the block."""
    place = programs()
    assert place is not None
    with tempfile.TemporaryDirectory(prefix="postgres-", ignore_cleanup_errors=True) as folder:
        os.chmod(folder, 0o755)
        server = Server(Path(folder), place)
        server.start()
        try:
            yield server
        finally:
            server.stop()
