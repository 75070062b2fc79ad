"""An interrupt while the program is still being loaded: one line, and the exit code of others."""

import subprocess
import sys

import pytest

from tui import cli, entry


@pytest.mark.parametrize("module", ["tui.cli", "cyclopts", "tui.output"])
def test_an_interrupt_while_the_command_line_is_loaded_is_told_in_one_line(module):
    program = f"""
import sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupting())
from tui.entry import main
sys.exit(main())
"""
    run = subprocess.run(
        [sys.executable, "-c", program, "--version"], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr, run.stdout) == (130, "error: interrupted\n", "")


def test_it_hands_on_to_the_command_line(monkeypatch):
    monkeypatch.setattr(cli, "main", lambda: 7)
    assert entry.main() == 7


@pytest.mark.parametrize(
    ("closed", "code", "said"),
    [("2>&-", 0, ""), ("<&-", 0, ""), (">&-", 1, "error: there is no stdout to write")],
)
def test_streams_that_the_caller_closed(closed, code, said):
    words = "measure --dry-run --json --unit adss --instrument sim: --level 2"
    words += " --start 100 --stop 110 --points 3"
    program = "from tui.entry import main; raise SystemExit(main())"
    line = f'"{sys.executable}" -c "{program}" {words}'
    run = subprocess.run(
        ["/bin/sh", "-c", f"{line} {closed}"], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr[: len(said)]) == (code, said)
    assert bool(run.stdout) == (code == 0)
