"""The log that a user can turn on: what goes into it, and that it is never in the way."""

import logging
import os
import subprocess
import sys

import pytest

from tui.cli import main
from tui.logs import logging_to_file, silence
from tui.places import log_path


@pytest.fixture(autouse=True)
def _own_state(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def test_log_is_written_only_on_request(capsys):
    assert main(["extract", "nowhere.csv"]) == 2
    assert not log_path().exists()
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("words", [["--log-level", "info"], ["--log-level=info"]])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_command_error_and_end_are_logged(words, place, capsys):
    line = ["extract", "nowhere.csv"]
    assert main([*line[:place], *words, *line[place:]]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"log: {log_path()}" in err
    text = log_path().read_text()
    assert "INFO lashbench.command: lashbench extract nowhere.csv" in text
    assert "ERROR lashbench.console: nowhere.csv" in text
    assert "exit code 2" in text
    assert "Traceback" not in text


def test_debug_logs_trace_and_error_logs_little(capsys):
    main(["extract", "nowhere.csv", "--log-level", "error"])
    assert "INFO" not in log_path().read_text()
    main(["extract", "nowhere.csv", "--log-level", "debug"])
    assert "Traceback" in log_path().read_text()
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--log-level", "loud"], ["--log-level"], ["--log-level="]])
def test_invalid_log_level_is_refused(words, capsys):
    assert main(["extract", "x.csv", *words]) == 2
    err = capsys.readouterr().err
    assert "debug, info, warning, error" in err
    assert err.count("\n") == 1
    assert not log_path().exists()


def test_unwritable_log_stops_nothing(monkeypatch, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert main(["--log-level", "info", "completion", "bash"]) == 0
    out, err = capsys.readouterr()
    assert "cannot be written" in err
    assert "_lashbench" in out


def test_inner_log_block_keeps_outer_level():
    logger = logging.getLogger("lashbench")
    silence()
    before = (logger.level, list(logger.handlers))
    with logging_to_file("debug") as outer, logging_to_file("error") as inner:
        assert inner == outer == log_path()
        logger.debug("still heard")
    assert log_path().read_text().count("still heard") == 1
    assert (logger.level, logger.handlers) == before


def test_log_of_one_megabyte_is_rotated():
    with logging_to_file():
        for number in range(120):
            logging.getLogger("lashbench").info("line %d of many: %s", number, 10_000 * "x")
    assert log_path().stat().st_size <= 1_000_000
    assert log_path().with_name("lashbench.log.1").exists()


def test_library_warnings_go_only_to_log(tmp_path):
    program = "\n".join(
        [
            "import warnings",
            "from tui import cli",
            "from tui.commands.files import extract",
            "def warn(**_): warnings.warn('overflow encountered', RuntimeWarning)",
            "extract.extract = warn",
            "import sys; sys.exit(cli.main(sys.argv[1:]))",
        ]
    )
    for words in ([], ["--log-level", "info"]):
        ended = subprocess.run(
            [sys.executable, "-c", program, "extract", *words],
            capture_output=True, text=True, check=True, env=os.environ,
        )  # fmt: skip
        assert "overflow" not in ended.stderr
    assert "overflow encountered" in log_path().read_text()


@pytest.mark.parametrize("kind", ["symlink_to", "hardlink_to"])
def test_log_is_not_written_through_link(kind, tmp_path, capsys):
    theirs = tmp_path / "colleague.txt"
    theirs.write_text("results")
    log_path().parent.mkdir(parents=True)
    getattr(log_path(), kind)(theirs)
    assert main(["--log-level", "info", "completion", "bash"]) == 0
    assert "cannot be written" in capsys.readouterr().err
    assert theirs.read_text() == "results"
