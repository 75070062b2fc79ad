"""``lashbench replay``: a recorded session as it ran, at any speed.

Owns the options of the verb.
"""

from __future__ import annotations

from pathlib import Path

from daq.errors import InputError
from tui.commands.bench import require_terminal
from tui.options import Real, Whole
from tui.reading_options import NO_OPTIONS, ReadingOptions

__all__ = ["replay"]


def replay(
    file: Path,
    /,
    *,
    id: Whole | None = None,
    speed: Real = 1.0,
    given: ReadingOptions = NO_OPTIONS,
) -> int:
    """Show a recorded session as it ran: from a bench's history, or from a response file.

    Space pauses, + and - change the speed, full stop and comma jump. Waits of
    more than five seconds are shortened.

    Parameters
    ----------
    file
        History of a bench (the --db of measure), or a response file.
    id
        Measurement of the history; the latest with points if left out.
    speed
        How many times as fast as it ran.
    """
    if not 0.001 <= speed <= 1e6:
        raise InputError(f"--speed {speed:g} must be between 0.001 and 1000000")
    from tui.app.state.recording import read_recording

    recording = read_recording(file, id, given.reading())
    require_terminal("replay")
    from tui.app.state.replay import ReplayApp

    code = ReplayApp(recording, speed).run()
    return code or 0
