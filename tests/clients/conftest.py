"""Clients of others, from a folder of their own: `make clients` puts them there.

What each says is written to `build/clients`, and must be what docs/transcripts shows.
"""

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / ".venv" / "clients"
sys.path.append(str(FOLDER))
MADE = Path(__file__).parents[2] / "build" / "clients"


@pytest.fixture
def heard(request):
    """Wraps an instrument; its dialogue is compared when the test is over."""
    from heard import KEPT, Heard, commands

    instruments = []

    def wrapped(instrument):
        instruments.append(Heard(instrument))
        return instruments[-1]

    yield wrapped
    (one,) = instruments
    lines = one.lines()
    if not lines:
        return  # the client is not installed
    name = f"{request.node.name.removeprefix('test_')}.txt"
    MADE.mkdir(parents=True, exist_ok=True)
    (MADE / name).write_text("\n".join(lines) + "\n", encoding="ascii")
    kept = KEPT / name
    assert kept.exists(), f"copy {MADE / name} to {kept}"
    assert commands(lines) == commands(kept.read_text(encoding="ascii").splitlines())
