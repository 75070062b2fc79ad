"""What keeps strangers' text from doing anything: no code is run from data, no path escapes."""

import ast
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest

from analysis.diagnosis import figures as diagnosis_figures
from daq.formats.atomic import file_stem
from sim.analyser35670a import Analyser35670A, Choices
from sim.instrument.plant import LinearPlant
from sim.serve import Server

ROOT = Path(__file__).parents[1]
SOURCES = sorted(path for floor in ("daq", "sim", "analysis", "tui") for path in
                 (ROOT / floor).rglob("*.py"))  # fmt: skip
MODULES = {"pickle", "shelve", "marshal", "dill", "joblib", "cloudpickle", "yaml"}
"""Modules whose files can hold code."""
CALLS = {"eval", "exec", "compile", "__import__", "os.system", "os.popen"}


def dangers(source: str) -> list[str]:
    """What in a program could run what it reads."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [name.name for name in node.names if name.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in MODULES:
            found.append(node.module)
        elif isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            words = {word.arg: ast.unparse(word.value) for word in node.keywords}
            starts = name.startswith("subprocess.") and words.get("shell", "False") != "False"
            runs_nothing = ast.unparse(node) == "exec('')"
            if name in CALLS and not runs_nothing or starts:
                found.append(name)
            if name in ("np.load", "numpy.load") and words.get("allow_pickle") != "False":
                found.append(name)
            if words.get("allow_pickle", "False") != "False":
                found.append(name)
    return found


def test_package_cannot_execute_what_it_reads():
    """But for one place: effects of a unit's own, which a person asks for (--trust-effects)."""
    assert len(SOURCES) > 150
    found = {str(path.relative_to(ROOT)): dangers(path.read_text()) for path in SOURCES}
    allowed = found.pop("sim/own_effects/definitions.py")
    assert allowed == ["compile"]
    assert {path: names for path, names in found.items() if names} == {}


@pytest.mark.parametrize(
    "source",
    ["import pickle", "from pickle import loads", "eval(x)", "exec(x)", "exec('x')", "exec('', x)",
     "np.load(f)", "os.system(x)", "subprocess.run(x, shell=True)",
     "np.load(f, allow_pickle=True)"],
)  # fmt: skip
def test_dangerous_source_is_found(source):
    assert dangers(source)
    assert not dangers("exec('')"), "it runs nothing"


def test_simulated_analyser_is_unreachable_from_outside():
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.1), Choices())
    with Server(instrument, tcp=0, prologix_tcp=0) as server:
        for name in ("tcp", "prologix_tcp"):
            host, port = server.addresses[name].split(":")
            assert host == "127.0.0.1"
            for outside in {place[4][0] for place in socket.getaddrinfo(socket.gethostname(), 0)}:
                if not outside.startswith("127.") and ":" not in outside:
                    with pytest.raises(OSError):
                        socket.create_connection((outside, int(port)), timeout=1.0)


@pytest.mark.parametrize("name", ["../../etc/x", "/etc/x", "a/b", "..", "", "\0", "C:\\x", "ADSS"])
def test_name_cannot_leave_its_folder(name, tmp_path, monkeypatch):
    class Figure:
        def savefig(self, stream, **_):
            stream.write(b"a figure")

    for made in ("residual_figure", "probability_figure"):
        monkeypatch.setattr(diagnosis_figures, made, lambda _: Figure())
    folder = tmp_path / "plots"
    for path in diagnosis_figures.draw_diagnosis(SimpleNamespace(unit=name), folder):
        assert path.resolve().parent == folder
    assert len(list(folder.iterdir())) == 2
    assert [place.name for place in tmp_path.iterdir()] == ["plots"]


def half_written(source: str) -> list[str]:
    """What in a program writes a file under its own name, where half of it may be seen."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        owner, verb = ast.unparse(node.func.value), node.func.attr
        first = ast.unparse(node.args[0]) if node.args else ""
        goes_to = {
            "savefig": first,
            "savez": first,
            "savez_compressed": first,
            "File": first if first and "'w'" in ast.unparse(node) else "stream",
            "write_text": owner,
            "write_bytes": owner,
            "open": owner if first in ("'w'", "'wb'", "'a'") else "stream",
        }
        # A stream is that of `daq.formats.atomic`, contents lie in memory.
        if goes_to.get(verb, "stream") not in ("stream", "content"):
            found.append(ast.unparse(node))
    return found


def test_no_file_is_written_in_place():
    """Half of it could be seen there; only what grows line by line is, each line whole."""
    assert {str(path): half_written(path.read_text()) for path in SOURCES
            if half_written(path.read_text())} == {}  # fmt: skip


@pytest.mark.parametrize(
    "source",
    ["figure.savefig(path)", "path.write_text(x)", "path.open('wb')", "h5py.File(path, 'w')",
     "partial.write_bytes(x)", "log.open('a')"],
)  # fmt: skip
def test_unsafe_writing_is_found(source):
    assert half_written(source)


def test_plain_names_are_unchanged():
    assert file_stem("ADSS") == "adss"
    assert file_stem("My gimbal 2") == "my-gimbal-2"
