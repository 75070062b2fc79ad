"""The demonstration: the whole way with quick judgements, what it says of right and wrong."""

import json
import os
import pty
import shlex
import signal
import subprocess
import sys

import numpy as np
import pytest

from daq.formats import read_response
from daq.store import Store
from sim.catalogue import CATALOGUE, COMMON
from sim.drawn_effects import draw_effect
from sim.unit import load_unit
from tui.cli import main
from tui.commands import demo as verb
from tui.computations import Computations
from tui.demonstration import hidden as secrets
from tui.demonstration import sweep
from tui.text.bode_text import bode_lines

ADSS = load_unit("adss")


def document(*causes, verdict="explained", rivals=()):
    uncertain = {"value": 0.3, "std": 0.02}
    return {
        "verdict": verdict,
        "causes": [
            {"effect": name, "probability": 0.9, "parameters": {
                p.name: {"value": 1.0, "std": 0.1, "unit": p.unit_symbol}
                for p in CATALOGUE[name].parameters
            }}
            for name in causes
        ],
        "rivals": [{"causes": list(names), "probability": 0.1} for names in rivals],
        "baseline": {"held_out_rms_sigma": 2.0, "held_out_rms_db": 2.0},
        "extended": {"held_out_rms_sigma": 1.0, "held_out_rms_db": 1.0},
        "gain": {"held_out_rms_ratio": 0.5},
        "contribution_ratio": {"baseline": uncertain, "extended": uncertain},
        "residual": [],
        "next_measurement": None,
        "elapsed_s": 1.0,
    }  # fmt: skip


class Diagnosed:
    def __init__(self, *causes):
        self._causes = causes

    def to_json(self):
        return document(*self._causes)

    def summary(self):
        return ["the diagnosis in words"]


@pytest.fixture
def quick(monkeypatch):
    """Few points, an estimate and a diagnosis at once; what was judged is kept."""
    from analysis import estimate

    judged = []
    monkeypatch.setattr(sweep, "POINTS", 9)
    monkeypatch.setattr(sweep, "SETTLE_CYCLES", 3)
    monkeypatch.setattr(sweep, "INTEGRATE_CYCLES", 3)

    def estimated(response, unit, progress=None, **options):
        uncertain = estimate.Uncertain(0.5, 0.1, (0.3, 0.7))
        total = estimate.Uncertain(0.066, 0.0)
        return estimate.Estimate("ADSS", uncertain, uncertain, uncertain, total, None, (), 1.0)

    def install(*causes):
        """The same as `main`, with these causes found."""

        def diagnosed(response, unit, *, cache, progress):
            for share in np.linspace(0.0, 1.0, 11):
                progress(share, "searching")
            judged.append(response)
            return Diagnosed(*causes)

        compute = Computations(estimate_response=estimated, diagnose_response=diagnosed)
        return judged, lambda words: main(words, compute)

    return install


def test_the_whole_way_over_a_socket(quick, tmp_path, capsys):
    judged, demo = quick("load-viscous-damping")
    out = tmp_path / "here" / "demo"
    assert demo(["demo", "--out", str(out)]) == 0
    text, told = capsys.readouterr()
    for number in range(1, 6):
        assert f"\n{number}. " in "\n" + text
    assert "SIMULATED" in text
    assert "source confirmed-off" in text
    assert "The diagnosis named it." in text
    assert "true 0.300" in text
    assert str((out / "report.html").resolve()) in text
    assert "--instrument TCPIP::127.0.0.1::" in told
    assert "diagnosing: 20 %" in told
    assert "\x1b" not in text + told
    assert (out / "measured.png").read_bytes().startswith(b"\x89PNG")
    page = (out / "report.html").read_text()
    assert "load-viscous-damping" in page
    assert len(read_response(out / "measured.csv")) == 27
    with Store(out / "bench.db", read_only=True) as store:
        assert store.measurements()[0].header.address.startswith("TCPIP::127.0.0.1::")
        assert len(judged[0]) == len(store.response(1)) == 27


def test_repeated_run_prints_same_points_and_json(quick, tmp_path, capsys):
    judged, demo = quick("load-inertia")
    for name in ("a", "b"):
        assert demo(["demo", "--json", "--out", str(tmp_path / name)]) == 0
        result = json.loads(capsys.readouterr().out)
    assert np.array_equal(judged[0].gain, judged[1].gain)
    assert result["hidden"]["effect"] == secrets.standing().effect.id
    assert result["outcome"] == "missed"
    assert result["diagnosis"]["causes"][0]["effect"] == "load-inertia"
    assert result["report"] == str(tmp_path / "b" / "report.html")


@pytest.mark.long
def test_surprise_differs_by_seed_and_can_repeat(quick, tmp_path, capsys):
    _, demo = quick("load-inertia")
    results = []
    for seed in ("4", "4", "5"):
        words = ["demo", "--surprise", "--seed", seed, "--json", "--out", str(tmp_path / "a b")]
        assert demo(words) == 0
        text, told = capsys.readouterr()
        results.append(json.loads(text))
        (line,) = (one for one in told.splitlines() if one.startswith("The same once more: "))
        assert shlex.split(line.partition(": ")[2]) == ["lashbench", *words[:4], *words[5:]]
    same, again, other = (result["hidden"] for result in results)
    assert same == again != other
    assert results[0]["guess"] is None


@pytest.mark.parametrize("words", [["--seed", "1"], ["--surprise", "--seed", "-1"]])
def test_seed_requires_surprise(words, capsys):
    assert main(["demo", *words]) == 2
    assert "--seed" in capsys.readouterr().err


class Interrupting:
    """A stream at whose end somebody presses Ctrl-C when the sweep is told."""

    def __init__(self, stream):
        self._stream = stream

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        if "sweeping" in text:
            os.kill(os.getpid(), signal.SIGINT)
        return self._stream.write(text)


def test_interrupted_sweep_ends_safe(quick, tmp_path, capsys, monkeypatch):
    _, demo = quick("load-inertia")
    monkeypatch.setattr(sys, "stderr", Interrupting(sys.stderr))
    assert demo(["demo", "--out", str(tmp_path)]) == 130
    out, err = capsys.readouterr()
    assert "source confirmed-off" in out
    assert "interrupted by SIGINT" in err
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("found", "outcome"),
    [
        (document("cable-stiffness"), "named"),
        (document("cable-stiffness", verdict="ambiguous"), "not alone"),
        (document("load-inertia", rivals=[["cable-stiffness"]]), "among the rivals"),
        (document("cable-stiffness", "load-inertia"), "among the rivals"),
        (document("load-inertia"), "missed"),
        (document(verdict="unexplained"), "missed"),
    ],
)
def test_right_and_wrong_guesses_are_distinguished(found, outcome):
    rng = np.random.default_rng(1)
    hidden = secrets.Hidden(0.4, draw_effect(ADSS, (110, 170), rng, ["cable-stiffness"]), 1)
    assert secrets.compare(hidden, found) == outcome
    lines = secrets.worded(hidden, outcome, found, "load-inertia")
    assert lines[0].startswith("Hidden was cable-stiffness.")
    assert "true 0.400" in lines[-2]
    assert lines[-1].endswith("load-inertia: not it")
    shown = any("found 1 +- 0.1" in line for line in lines)
    assert shown == any(cause["effect"] == "cable-stiffness" for cause in found["causes"])


class Person:
    """A console with answers."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def ask(self, question):
        self.asked.append(question)
        return self.answers.pop(0)


@pytest.mark.parametrize(
    ("answers", "guess"),
    [
        (["1"], "load-viscous-damping"),
        (["cable-stiffness"], "cable-stiffness"),
        ([""], None),
        ([None], None),
        (["0", "99", "nonsense", "2"], "shaft-damping"),
        (["nonsense", ""], None),
    ],
)
def test_guess_is_number_or_effect_name(answers, guess):
    person = Person(*answers)
    assert verb.ask_guess(person) == guess
    assert person.answers == []
    assert all(name in person.asked[0] for name in COMMON)


@pytest.mark.parametrize("unit", ["adss", "edss"])
@pytest.mark.parametrize("name", CATALOGUE)
def test_drawn_effect_is_in_range_and_visible(unit, name):
    """A drawn value lies in its range and at least a tenth off the datasheet."""
    subject = load_unit(unit)
    for seed in range(30):
        setting = draw_effect(subject, (40.0, 90.0), np.random.default_rng(seed), [name])
        for parameter in CATALOGUE[name].parameters:
            value = setting.values[parameter.name]
            low, high = parameter.range(subject)
            assert min(low, 40.0 if parameter.name == "f_p" else low) <= value <= high
            if (known := parameter.nominal(subject)) is not None:
                assert abs(value / known - 1.0) > 0.1


def test_every_common_effect_is_drawn():
    rng = np.random.default_rng(1)
    seen = {draw_effect(ADSS, (110.0, 170.0), rng).id for _ in range(500)}
    assert seen == set(COMMON)


def points(level):
    hertz = np.geomspace(100.0, 200.0, 21)
    return [(f, level * 10 ** (-f / 100) * np.exp(-1j * f / 50)) for f in hertz.tolist()]


def test_plot_shows_every_point_at_its_position():
    lines = bode_lines({1.5: [(100.0, 1.0), (200.0, 0.01j)]}, (100.0, 200.0))
    assert lines[1] == "     0 |o"
    assert lines[11] == "   -40 |" + " " * 69 + "o"
    assert lines[14] == "       |" + " " * 69 + "o"
    assert lines[15] == "     0 |o"
    assert lines[-1].split() == ["Hz", "100", "118.9", "141.4", "168.2", "200"]


def test_plot_size_does_not_depend_on_data():
    nothing = bode_lines({}, (100.0, 200.0))
    sizes = {len(nothing)}
    for levels in ({1.5: points(1.0)}, {1.5: points(1.0), 4.0: points(1e-3)},
                   {1.0: [(150.0, complex("nan")), (150.0, 0j)]}):  # fmt: skip
        lines = bode_lines(levels, (100.0, 200.0))
        sizes.add(len(lines))
        assert max(map(len, lines)) <= 78
        assert all(line.isascii() for line in lines)
    assert len(sizes) == 1
    both = "\n".join(bode_lines({1.5: points(1.0), 4.0: points(1e-3)}, (100.0, 200.0)))
    assert "o 1.5 V peak   x 4 V peak" in both
    assert both.count("x") > 15


def test_terminal_plot_is_redrawn_in_place():
    program = (
        "from tui.text.output import Console; c = Console()\n"
        "for n in range(3):\n"
        "    c.picture(['top', f'bottom {n}']); c.progress(n / 3, 'now')\n"
        "c.note('over')"
    )
    main_end, other = pty.openpty()
    run = subprocess.run([sys.executable, "-c", program], stderr=other, check=True)
    os.close(other)
    shown = os.read(main_end, 65536).decode()
    os.close(main_end)
    assert run.returncode == 0
    assert shown.count("\x1b[2A\x1b[J") == 3
    assert shown.rstrip().endswith("over")
