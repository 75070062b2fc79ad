"""The person at the bench of a first day: what is asked, what is taken, and what follows."""

import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, closing, contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.bench_server import served, simulated
from instruments.fake_analyser import known_gain

from daq.drivers import DRIVERS
from daq.driving.first_day import FirstDay, run
from daq.transports.open import open_transport
from sim.instrument.plant import LinearPlant
from tui.first_day.person import Person

CHECKED = [driver for driver in DRIVERS if driver.first_day is not None]
OFFERED = "[yes / no / not watched]"


class Terminal:
    """Our end of a terminal, read in the background."""

    def __init__(self, ours):
        self._ours = ours
        self.text = ""

    def wait(self, words, times=1, seconds=60.0):
        until_s = time.monotonic() + seconds
        while self.text.count(words) < times:
            assert time.monotonic() < until_s, f"{words!r} did not come in: {self.text!r}"
            self.take(0.1)

    def take(self, seconds):
        if select.select([self._ours], [], [], seconds)[0]:
            try:
                self.text += os.read(self._ours, 4096).decode()
            except OSError:  # its other end is closed
                time.sleep(seconds)

    def type(self, text):
        os.write(self._ours, text.encode())


@contextmanager
def first_day(url, folder, *words):
    """The verb in a process with a terminal of its own."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "tui.cli", "first-day", "--instrument", url, "--out"]
    with subprocess.Popen(
        [*command, str(folder), *words], stdin=theirs, stdout=theirs, stderr=theirs
    ) as program:
        os.close(theirs)
        try:
            yield program, Terminal(ours)
        finally:
            program.kill()
            os.close(ours)


@contextmanager
def terminal_of_this_process(monkeypatch):
    ours, theirs = pty.openpty()
    with (
        os.fdopen(theirs, "rb", buffering=0) as file,
        os.fdopen(os.dup(theirs), "wb", buffering=0) as out,
    ):
        monkeypatch.setattr(sys, "stdin", file)
        monkeypatch.setattr(sys, "stderr", out)
        yield Terminal(ours), lambda text: os.write(out.fileno(), text.encode())
    os.close(ours)


def ended(program, terminal, seconds=60.0):
    until_s = time.monotonic() + seconds
    while program.poll() is None:
        assert time.monotonic() < until_s, terminal.text
        terminal.take(0.1)
    terminal.take(0.1)
    return program.returncode


@pytest.mark.parametrize(
    "driver",
    [
        driver.scheme
        if driver is CHECKED[0]
        else pytest.param(driver.scheme, marks=pytest.mark.long)
        for driver in CHECKED
    ],
)
def test_driving_source_ends_the_checks_at_once(tmp_path, driver):
    box = simulated(driver, LinearPlant(known_gain))
    with served(box, driver=driver) as url, first_day(url, tmp_path) as (program, terminal):
        terminal.wait("may")
        terminal.type("y\n")
        terminal.wait(OFFERED)
        # Neither a word that is not offered nor an empty line is an answer.
        terminal.type("maybe\n")
        terminal.wait("none of the answers")
        terminal.type("\n")
        terminal.wait("none of the answers", times=2)
        terminal.type("no\n")
        assert ended(program, terminal) == 1
    assert box.points_begun == 0
    assert box.driven_v == 0
    said = " ".join(terminal.text.split())
    assert "instrument and person disagree" in said
    assert "switch it off by hand" in said
    report = (tmp_path / "report.md").read_text()
    (headline,) = [line for line in report.splitlines() if "source in the end" in line]
    assert "disagree" in headline
    assert headline != "- source in the end: confirmed-off"
    assert "| safe-off | **differs** |" in report


@pytest.mark.parametrize("signals", [pytest.param(1, marks=pytest.mark.long), 3])
def test_interrupt_while_driving_ends_safe_with_report(tmp_path, signals):
    box = simulated("sr785", LinearPlant(known_gain))
    with (
        served(box, driver="sr785") as url,
        first_day(url, tmp_path, "--yes", "--json") as (program, terminal),
    ):
        terminal.wait(OFFERED)
        terminal.type("yes\n")
        terminal.wait("THE SOURCE MAY DRIVE UP TO 0.1 V PEAK")
        terminal.wait("SRCO 0: does the source drive?")
        terminal.type("no\n")
        terminal.wait("SRCO 1: does the source drive?")
        for _ in range(signals):
            program.send_signal(signal.SIGINT)
            time.sleep(0.05)
        assert ended(program, terminal) == 130
    assert box.driven_v == 0
    assert '"ended": "interrupted"' in terminal.text
    assert '"source_state": "confirmed-off"' in terminal.text
    assert str(tmp_path / "report.md") in terminal.text
    report = (tmp_path / "report.md").read_text()
    assert "- ended: interrupted" in report
    assert "- source in the end: confirmed-off" in report
    assert "| levels | **holds** |" in report


def test_input_before_question_is_discarded(monkeypatch):
    with terminal_of_this_process(monkeypatch) as (terminal, say):
        terminal.type("no\n")
        time.sleep(0.1)
        answers = []
        person = Person(say, 0.1)
        asking = threading.Thread(target=lambda: answers.append(person.look("at rest?", False)))
        asking.start()
        terminal.wait(OFFERED)
        time.sleep(0.3)
        assert not answers
        terminal.type("  Not  Watched \n")
        asking.join(10)
        assert answers == [None]


@settings(max_examples=25, deadline=None)
@given(st.lists(st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=12)))
def test_only_offered_answers_are_accepted(tries):
    offered = {"y": True, "yes": True, "n": False, "no": False, "not watched": None}
    strays = [one for one in tries if " ".join(one.split()).lower() not in offered]
    with pytest.MonkeyPatch.context() as patch, terminal_of_this_process(patch) as (terminal, say):
        answers = []
        person = Person(say, 0.1)
        asking = threading.Thread(target=lambda: answers.append(person.look("at rest?", False)))
        asking.start()
        terminal.wait(OFFERED)
        for number, stray in enumerate(strays, 1):
            terminal.type(f"{stray}\n")
            terminal.wait("none of the answers", times=number)
            assert not answers
        terminal.type("YES\n")
        asking.join(10)
        assert answers == [True]


@pytest.mark.parametrize(
    ("scheme", "asks"),
    [("", "after the last point"), ("sr785", "output switch"), ("sampled", "ramp")],
)
def test_unanswered_question_switches_source_off(monkeypatch, scheme, asks):
    """The check is given up, the source made safe, and that is said."""
    (driver,) = [driver for driver in DRIVERS if driver.scheme == scheme]
    checks = [check for check in driver.first_day() if check.name == asks]
    box = simulated(scheme, LinearPlant(known_gain))
    with (
        terminal_of_this_process(monkeypatch) as (terminal, say),
        served(box, driver=scheme) as url,
        closing(open_transport(url.removeprefix(f"{scheme}:"))) as wire,
    ):
        analyser = driver.drive(wire)
        person = Person(say, 0.1, driven_s=0.4)
        day = FirstDay(analyser, wire, 0.1, person.look, analyser.make_safe, lambda: None)
        (finding,) = run(day, checks)
        terminal.wait("no answer within 0.4 s: the source is being made safe")
    assert finding.verdict == "not looked at"
    assert "the source was made safe" in finding.seen
    assert box.driven_v == 0


@pytest.mark.slow
def test_pulled_cable_ends_with_clear_error(tmp_path):
    """Exit code 3; the report tells what is known of the source."""
    box = simulated("sr785", LinearPlant(known_gain))
    with ExitStack() as cable:
        url = cable.enter_context(served(box, driver="sr785"))
        with first_day(url, tmp_path / "out", "--yes") as (program, terminal):
            terminal.wait(OFFERED)
            terminal.type("not watched\n")
            terminal.wait("SRCO 0: does the source drive?")
            # Meanwhile the report tells what was found so far.
            report = tmp_path / "out" / "report.md"
            assert "| identity | **holds** |" in report.read_text()
            assert "- ended: not yet" in report.read_text()
            cable.close()
            terminal.type("no\n")
            terminal.wait("the watchdog opens the instrument anew")
            assert "- source in the end: unknown" in report.read_text()
            program.send_signal(signal.SIGINT)
            assert ended(program, terminal) == 3
    said = " ".join(terminal.text.split())
    assert "SOURCE OFF UNKNOWN: switch it off by hand" in said
    assert "- ended: early" in report.read_text()
