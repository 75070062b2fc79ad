"""The frame of the command line: verbs, streams, exit codes, and what help may cost."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from daq import errors
from tui import cli
from tui.text import output

HEAVY = (
    "scipy",
    "numba",
    "llvmlite",
    "matplotlib",
    "textual",
    "h5py",
    "sqlalchemy",
    "pyvisa",
    "serial",
)


@pytest.mark.parametrize("words", [[], ["--help"], ["--version"], list(cli.VERBS)])
def test_help_loads_none_of_the_heavy_libraries(words):
    """Of one verb after another in one program: what one loads would be there with the next."""
    # The list of verbs has no markdown in it, and its reader takes a third of the time.
    heavy = HEAVY if words[1:] else (*HEAVY, "markdown_it")
    program = f"""
import sys
from tui.cli import main
for words in {[[verb, "--help"] for verb in words] if words[1:] else [words]!r}:
    code = main(words)
    loaded = sorted(set({heavy!r}) & set(sys.modules))
    if loaded or code:
        sys.exit(f"{{words}} gave {{code}} and loaded {{loaded}}")
    print("shown", *words)
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    shown = re.split("^shown.*$", run.stdout, flags=re.MULTILINE)[:-1]
    assert len(shown) == (len(words) if words[1:] else 1)
    assert all(one.strip() for one in shown)


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["--version"]])
def test_the_front_page_loads_no_parser(words):
    program = (
        "import sys; from tui.entry import main; code = main();"
        "loaded = sorted({'cyclopts', 'rich', 'numpy'} & set(sys.modules));"
        "sys.exit(f'loaded {loaded}' if loaded else code)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.count("\n") == (1 if words == ["--version"] else len(cli.VERBS) + 11)
    assert max(map(len, run.stdout.splitlines())) <= 80


def test_help_to_full_stdout_is_an_error():
    script = Path(sys.executable).with_name("lashbench")
    with open("/dev/full", "w") as full:
        run = subprocess.run([script, "--help"], stdout=full, stderr=subprocess.PIPE, text=True,
                             check=False)  # fmt: skip
    assert run.returncode == 1
    assert "make room" in run.stderr


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_explains_all_its_options(verb, capsys):
    assert cli.main([verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert cli.VERBS[verb][1] in text
    for line in text.splitlines():
        words = line.strip("│* ").split()
        if words and words[0].startswith("--"):
            assert len(words) > 2, f"{verb} {words[0]} has no explanation"


def test_the_console_script_is_the_entry_point():
    script = Path(sys.executable).with_name("lashbench")
    run = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == cli.version("lashbench")


@pytest.fixture
def broken_verb(monkeypatch):
    """A verb that raises what it is given."""

    def install(error):
        def broken(*, console: output.Injected) -> None:
            """Break."""
            console.note("narration")
            raise error

        module = type(sys)("broken_verb")
        module.broken = broken
        monkeypatch.setitem(sys.modules, "broken_verb", module)
        monkeypatch.setitem(cli.VERBS, "broken", ("broken_verb:broken", "Break."))

    return install


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.AnalysisError("no peak"), 1),
        (errors.InstrumentError("-222"), 1),
        (errors.ConfigurationError("key x"), 2),
        (errors.FileFormatError("line 4"), 2),
        (errors.LinkError("refused"), 3),
        (errors.ProtocolError("garbled"), 3),
        (errors.BenchTimeout("*OPC?"), 4),
        (errors.LimitError("9 V"), 5),
        (KeyboardInterrupt(), 130),
        (ZeroDivisionError("division\nby zero"), 1),
    ],
)
def test_error_is_one_line_with_exit_code(broken_verb, capsys, error, code):
    broken_verb(error)
    assert cli.main(["broken", "--quiet"]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert " ".join(str(error).split()) in err
    assert ("internal error" in err) == isinstance(error, ZeroDivisionError)

    assert cli.main(["--debug", "broken"]) == code
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert err.startswith("narration\n")


def wrapped(error):
    """What compiled code makes of an error that meets it."""
    outer = SystemError("<function agree> returned a result with an exception set")
    outer.__cause__ = SystemError("<built-in method> returned a result with an exception set")
    outer.__cause__.__cause__ = error
    return outer


@pytest.mark.parametrize(
    ("root", "said", "code"),
    [(KeyboardInterrupt(), "interrupted", 130), (ValueError("x"), "internal error: SystemErr", 1)],
)
def test_interrupt_in_compiled_code_is_interrupt(broken_verb, capsys, root, said, code):
    broken_verb(wrapped(root))
    assert cli.main(["broken", "--quiet"]) == code
    assert capsys.readouterr().err.startswith(f"error: {said}")


def test_error_while_handling_interrupt_is_reported(broken_verb, capsys):
    error = errors.LinkError("the source may be on")
    error.__context__ = KeyboardInterrupt()
    broken_verb(error)
    assert cli.main(["broken", "--quiet"]) == 3
    assert capsys.readouterr().err == "error: the source may be on\n"


@pytest.mark.parametrize(
    "line",
    [
        "simulat",
        "simulate",
        "simulate --unit adss --ratio half",
        "--bogus",
        "extract",
        "extract one.csv two.csv",
        "extract nowhere.csv",
        "estimate --unit adss",
        "estimate --unit adss --arf-hz 128",
        "estimate --unit adss --arf-hz 128 --rf-hz nan",
        "estimate --unit adss --arf-hz 128 --rf-hz 137 --total-backlash-unknown",
        "estimate x.csv --unit adss --arf-hz 128 --rf-hz 137",
        "estimate x.csv --unit nosuchunit",
        "reproduce --plots /dev/null",
        "reproduce --json=maybe",
    ],
)
def test_usage_error_is_one_line_exit_2(line, capsys):
    assert cli.main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("diagnose x.csv", "--unit is missing; see lashbench diagnose --help"),
        ("diagnose x.csv --unit", "--unit has no value; see lashbench diagnose --help"),
        ("measure --unit adss", "--instrument is missing; see lashbench measure --help"),
        ("diagnos", 'Unknown command "diagnos". Did you mean "diagnose"?; see lashbench --help'),
        ("tidy", 'Unknown command "tidy"; see lashbench --help'),
    ],
)
def test_incomplete_command_line_names_missing_part(line, said, capsys):
    assert cli.main(line.split()) == 2
    assert capsys.readouterr().err == f"error: {said}\n"


def talking(body):
    """The command of a program whose one verb does that with its console."""
    program = (
        "import sys, types; from tui import cli; from tui.text import output;"
        "talk = types.ModuleType('talk'); sys.modules['talk'] = talk;"
        f"exec('def talk(*, console: Injected): {body}',"
        "{'Injected': output.Injected}, talk.__dict__);"
        "cli.VERBS['talk'] = ('talk:talk', 'Talk.'); sys.exit(cli.main(['talk']))"
    )
    return [sys.executable, "-c", program]


def test_closed_stdout_is_no_error():
    with subprocess.Popen(
        talking('console.data("x" * 10**6)'), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
        assert run.wait() == 0


NARRATION = '[console.note("n" * 100) for _ in range(5000)]; console.data("the answer")'


def test_closed_stderr_does_not_stop_the_work():
    with subprocess.Popen(
        talking(NARRATION), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        run.stderr.close()
        assert run.stdout.read() == b"the answer\n"
        assert run.wait() == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
def test_full_disk_is_reported_in_words():
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(talking(NARRATION), stdout=full, stderr=subprocess.PIPE, check=False)
    assert run.returncode == 1
    last = run.stderr.decode().splitlines()[-1]
    assert last == (
        "error: the output could not be written (No space left on device); "
        "send it where there is room"
    )


def test_json_has_null_for_not_a_number():
    np = pytest.importorskip("numpy")
    content = {
        "a": float("nan"),
        "b": [np.float64(1.5), float("inf")],
        "c": np.array([1.0, np.nan]),
        "d": (np.int64(2), np.bool_(True), None, "µ"),
    }
    assert json.loads(output.as_json(content)) == {
        "a": None,
        "b": [1.5, None],
        "c": [1.0, None],
        "d": [2, True, None, "µ"],
    }


def test_a_terminal_without_the_character_shows_another():
    program = "from tui.text.output import Console; Console().data('1 ± 2')"
    run = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        check=True,
    )
    assert run.stdout == b"1 ? 2\n"


def test_foreign_text_sends_no_terminal_sequences(capsys):
    console = output.Console()
    console.note("unit \x1b[31mred\x00, serial a\tb")
    console.error("no \x1b]0;title\x07 here")
    console.data("row 1\nrow \x9b2J")
    out, err = capsys.readouterr()
    assert err == "unit \\x1b[31mred\\x00, serial a\tb\nerror: no \\x1b]0;title\\x07 here\n"
    assert out == "row 1\nrow \\x9b2J\n"


@pytest.mark.parametrize("verb", ["export", "replay", "measure --unit adss --resume"])
def test_impossible_identifier_is_a_usage_error(verb, tmp_path, capsys):
    db = tmp_path / "m.db"
    place = "replay {db} --id {id}" if verb == "replay" else f"{verb} {{id}} --db {{db}}"
    words = place.format(db=db, id="9" * 20).split()
    words += ["--instrument", "sim:"] if verb.startswith("measure") else []
    words += ["--out", str(tmp_path / "x.csv")] if verb == "export" else []
    assert cli.main(words) == 2
    assert "is too large a number" in capsys.readouterr().err
