"""The commands and Python pieces that the documentation prints, and a newcomer who types them.

Quickly (in the tests) sweeps have few points and few cycles, and of what takes
minutes the command line is parsed and the files that it names must be there.
In full (`make docs`) everything is run as it is printed. Instruments that the
pages name and nobody has here are replaced by the simulated one, after their
address was read.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from instruments.bench_server import gimbal_analyser, served, serving
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
SLOW = {"estimate", "diagnose", "prepare", "report", "reproduce", "demo", "plan", "commission"}
SCREENS = {"bench", "replay"}
_STORED = 6
"""Points that the interrupted measurement has."""
PROGRAMS = {"lashbench", "make", "python", ".venv/bin/pytest", "uv", "pipx", "git", "cd"}


def pages(root: Path = ROOT) -> list[Path]:
    """Every Markdown file that users read."""
    return sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md")])


def pieces(page: Path) -> Iterator[tuple[str, str]]:
    """What a page asks to be run, in its order: ("command", line) or ("python", code).

    What a block of text right after a piece of Python says is what that must
    print: ("printed", text).
    """
    before = ""
    for block in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        if block.type not in ("fence", "code_block"):
            continue
        before, info = block.info, before
        if block.info == "python":
            yield "python", block.content
        elif block.info == "text" and info == "python":
            yield "printed", block.content
        elif (lines := _lines(block.content)) and lines[0].split()[0] in PROGRAMS:
            yield from (("command", line) for line in lines)


def mentions(page: Path) -> Iterator[str]:
    """Commands of lashbench in running text."""
    for block in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        for token in block.children or []:
            if token.type == "code_inline" and token.content.startswith("lashbench "):
                yield token.content


def _lines(text: str) -> list[str]:
    joined = re.sub(r"\\\n\s*", "", text)
    stripped = (line.strip() for line in joined.splitlines())
    return [line for line in stripped if line and not line.startswith("#")]


class Newcomer:
    """Types what one page prints, in a folder of its own."""

    def __init__(self, folder: Path, full: bool = False) -> None:
        self._folder, self._full = folder, full
        self._stack = ExitStack()
        self._places: dict[str, str] = {}
        self._written: set[str] = set()
        self._names: dict[str, object] = {"__name__": "__main__"}
        for shared in ("tests", "docs", "configs", "README.md"):
            (folder / shared).symlink_to(ROOT / shared)

    def __enter__(self) -> Newcomer:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def run(self, kind: str, text: str) -> str:
        """Do one piece and return what it printed.

        Raises
        ------
        AssertionError
            If it does not do what the page says.
        """
        if kind == "python":
            printed = StringIO()
            with redirect_stdout(printed):
                exec(compile(text, "page", "exec"), self._names)  # noqa: S102
            return printed.getvalue()
        words = shlex.split(text, comments=True)
        if words[0] == "lashbench":
            return self._lashbench(words[1:], text)
        if words[0] == "make":
            known = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
            assert set(words[1:]) <= set(known), f"{text}: no such target"
        elif words[0] in ("python", ".venv/bin/pytest"):
            assert (ROOT / words[1]).is_file(), f"{text}: no such script"
        else:
            assert words[0] in PROGRAMS, f"{text}: {words[0]} is unknown to the newcomer"
        return ""

    def _lashbench(self, words: list[str], line: str) -> str:
        words = self._reachable(words or ["bench"])
        verb = words[0]
        if "|" in words or ">" in words:
            return self._shell(line)
        if verb == "serve":
            return self._serve(words)
        if verb in SCREENS or (verb in SLOW and not self._full):
            return self._parse(words, line)
        if not self._full and verb == "history" and "--estimate" not in words:
            words = [*words, "--estimate", "none"]
        if not self._full and verb in ("measure", "simulate") and "--dry-run" not in words:
            if verb == "measure":
                self._typed([*words, "--dry-run"], line)
            words = _short(words)
        return self._typed(words, line)

    @staticmethod
    def _typed(words: list[str], line: str) -> str:
        from tui.cli import main

        printed = StringIO()
        with redirect_stdout(printed):
            code = main(words)
        assert code == 0, f"{line}: exit code {code}"
        return printed.getvalue()

    def _reachable(self, words: list[str]) -> list[str]:
        """The same words with instruments that are here."""
        from tui.bench import drives_hardware

        for printed, actual in self._places.items():
            words = [word.replace(printed, actual) for word in words]
        if "--instrument" not in words:
            return words
        place = words.index("--instrument") + 1
        here = any(actual in words[place] for actual in self._places.values())
        if not drives_hardware(words[place]):
            return words
        replaced = [*words[:place], words[place] if here else "sim:", *words[place + 1 :]]
        return replaced if "--yes" in words else [*replaced, "--yes"]

    def _serve(self, words: list[str]) -> str:
        """Serve on free ports, and remember which stand for those that are printed."""
        ports = {words[i]: words[i + 1] for i, w in enumerate(words) if w.endswith("tcp")}
        free = [w if words[i - 1] not in ports else "0" for i, w in enumerate(words)]
        _bound(free)
        if self._full:
            pace = [] if "--speed" in free else ["--speed", "fast"]
            served = self._stack.enter_context(serving(*free[1:], *pace))
        else:
            wires = {option.lstrip("-").replace("-", "_") for option in ports}
            served = {w: self._stack.enter_context(served_here(w)) for w in wires}
        for option, port in ports.items():
            actual = re.findall(r":(\d+)", served[option.lstrip("-").replace("-", "_")])[-1]
            self._places[f"127.0.0.1::{port}::"] = f"127.0.0.1::{actual}::"
            self._places[f"127.0.0.1:{port}"] = f"127.0.0.1:{actual}"
        return ""

    def _shell(self, line: str) -> str:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", line],
            capture_output=True, text=True, cwd=self._folder, env=os.environ | {"PATH": path},
        )  # fmt: skip
        assert done.returncode == 0, f"{line}: {done.stderr}"
        return done.stdout

    def _parse(self, words: list[str], line: str) -> str:
        """Read a line that is not run; what it would write counts as being there."""
        trusted = {"LASHBENCH_TRUST_EFFECTS": "1"} if "--trust-effects" in words else {}
        words = [word for word in words if word != "--trust-effects"]
        _bound(words)
        for word in words[1:2]:
            known = word.startswith("-") or word.isdecimal() or word in self._written
            assert known or Path(word).exists(), f"{line}: there is no {word}"
        if "--unit" in words:
            from sim.unit import load_unit

            with patch.dict(os.environ, trusted):
                load_unit(words[words.index("--unit") + 1])
        options = zip(words, words[1:], strict=False)
        self._written |= {word for option, word in options if option in ("--out", "--db")}
        return ""


def _bound(words: list[str]) -> None:
    """Have the command line read a line."""
    from tui.cli import VERBS, build_app

    assert words[0] in VERBS, f"{words[0]}: no such verb"
    build_app().parse_args(words, exit_on_error=False, print_error=False, help_on_error=False)


def _short(words: list[str]) -> list[str]:
    """A measurement or simulation with few points and few cycles; one that goes on, as it is."""
    if "--resume" in words:
        return words if "--run-in" in words else [*words, "--run-in", "1"]
    few = {"--points": "5", "--settle-cycles": "2", "--integrate-cycles": "4"}
    kept = [w for i, w in enumerate(words) if w not in few and words[i - 1] not in few]
    return [*kept, *(word for pair in few.items() for word in pair)]


@contextmanager
def served_here(wire: str) -> Iterator[str]:
    """What `serve` serves, in a thread."""
    with served(gimbal_analyser(), wire) as url:
        yield url


def stocked_history(path: Path) -> None:
    """A bench's history as the pages suppose it: twelve measurements, the last interrupted."""
    from daq.control import SessionControl
    from daq.plan import SweepPlan, spaced_frequencies
    from daq.session_events import PointStored
    from daq.session_request import SessionRequest
    from daq.store import Store
    from daq.store_records import MeasurementHeader
    from sim.unit import load_unit
    from tui.bench import bench_session, unit_limits

    unit = load_unit("adss")
    plan = SweepPlan(
        spaced_frequencies(100.0, 180.0, 9), (1.5, 2.5), settle_cycles=2, integrate_cycles=4
    )
    header = MeasurementHeader("ADSS", "SN 7", plan, "sim:", "the test of the pages")
    with Store(path, create=True) as store:
        for _ in range(11):
            store.begin(header)
    request = SessionRequest(header=header, limits=(unit_limits(unit),))
    with closing(bench_session("sim:", unit, path, request, SessionControl())) as events:
        for event in events:
            if isinstance(event, PointStored) and event.done == _STORED:
                break
