"""Signals as requests to a running session.

Owns which signal asks for what. A handler only leaves a request, so that no
number of key presses can cut the safe-off recipe short.

=========  ==================  ===================================================
SIGINT     Ctrl-C              end now, safe; the measurement can be resumed
SIGTERM    kill                the same
SIGHUP     terminal closed     the same
SIGQUIT    Ctrl-backslash      abort: end now, safe, for good
SIGUSR1                        pause after the point in hand; again: go on
SIGUSR2                        stop after the point in hand
SIGTSTP    Ctrl-Z              ignored: a halted program would leave the source on
=========  ==================  ===================================================
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import asyncio

    from daq.control import SessionControl

__all__ = ["ending_on_signals", "listening", "waiting"]


@contextmanager
def listening(control: SessionControl, told: Callable[[str], None]) -> Iterator[None]:
    """Let signals reach a session until the block ends; nothing outside the main thread.

    Parameters
    ----------
    control
        Of the session.
    told
        Called with a line for the person who sent the signal.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    for name, act in _handlers(control, told).items():
        number = getattr(signal, name, None)
        if number is not None:
            before[number] = signal.signal(number, act)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def waiting(told: Callable[[str], None]) -> Iterator[None]:
    """Between the sessions of one program, let a pause or a stop end nothing but be told.

    Their usual effect is to end the program. Nothing outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    for name in ("SIGUSR1", "SIGUSR2"):
        if hasattr(signal, name):
            number = getattr(signal, name)
            before[number] = signal.signal(
                number, lambda _number, _frame: told("nothing is measured now: nothing to pause")
            )
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ending_on_signals(
    loop: asyncio.AbstractEventLoop, at_once: Callable[[], None], end: Callable[[], None]
) -> None:
    """Let signals that end a program end one that draws a screen; nothing outside the main thread.

    Parameters
    ----------
    loop
        Of the screen, which runs.
    at_once
        Called by the handler itself, whatever the loop does; must wait for nothing.
    end
        Called in the loop, with every such signal.
    """
    if threading.current_thread() is not threading.main_thread():
        return

    def act(number: int, _frame: object) -> None:
        at_once()
        try:
            loop.call_soon_threadsafe(end)
        except RuntimeError:
            # The loop is closed, and with it whatever drove: nothing is left to be ended in order.
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), act)
    if hasattr(signal, "SIGTSTP"):
        # A halted program would leave the source driving.
        signal.signal(signal.SIGTSTP, signal.SIG_IGN)


def _handlers(control: SessionControl, told: Callable[[str], None]) -> dict[str, Any]:
    def interrupt(number: int, _frame: object) -> None:
        name = signal.Signals(number).name
        again = control.cut is not None
        control.interrupt(f"interrupted by {name}")
        told("the source is being made safe; please wait" if again else "ending; making safe")

    def abort(_number: int, _frame: object) -> None:
        control.abort("aborted by SIGQUIT")
        told("aborting; making safe")

    def toggle_pause(_number: int, _frame: object) -> None:
        if control.paused:
            control.go_on()
            told("going on")
        else:
            control.pause()
            told("pausing after this point")

    def stop(_number: int, _frame: object) -> None:
        control.stop("stopped by SIGUSR2")
        told("stopping after this point")

    return {
        "SIGINT": interrupt,
        "SIGTERM": interrupt,
        "SIGHUP": interrupt,
        "SIGQUIT": abort,
        "SIGUSR1": toggle_pause,
        "SIGUSR2": stop,
        "SIGTSTP": signal.SIG_IGN,
    }
