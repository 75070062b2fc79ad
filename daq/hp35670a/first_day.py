"""What the driver of the 35670A assumes, as checks on a real instrument.

Owns the list of `docs/instrument.md` as far as a program can look at it. A check that sets a
level says that it drives, and is followed by the safe-off recipe.
"""

from __future__ import annotations

import time

import numpy as np

from daq.analyser import PointSettings
from daq.driving.first_day import WORDS, Check, FirstDay, at_rest
from daq.driving.replies import parse_string
from daq.driving.scpi_connection import Dialogue
from daq.driving.variance import normalised_variance
from daq.errors import LashbenchError
from daq.hp35670a.setup import enter_swept_sine
from daq.hp35670a.status import wait_until_done
from daq.transports.base import Deadline

__all__ = ["CHECKS"]

_BAND_HZ = (100.0, 200.0)
_MIDDLE_HZ = 150.0
_READINGS = 20
_WAIT_S = 60.0
_BARE_V = 0.01
_NOISY = 0.1
"""Normalised variance above which its scale cannot be told."""
_SETTINGS = "daq/hp35670a/settings.py"


def _talk(day: FirstDay) -> Dialogue:
    dialogue = Dialogue(day.transport)
    dialogue.on_exchange, dialogue.on_wait = day.analyser.on_exchange, day.analyser.on_wait
    return dialogue


def _swept(day: FirstDay) -> Dialogue:
    """In swept sine, at level 0, the error queue empty."""
    dialogue = _talk(day)
    enter_swept_sine(dialogue)
    return dialogue


def _refusal(dialogue: Dialogue, line: str) -> str:
    """What the error queue says of a command."""
    dialogue.send(line)
    return ", ".join(str(entry) for entry in dialogue.drain()) or "no error"


def _identity(day: FirstDay) -> tuple[bool | None, str]:
    found = day.analyser.identify()
    return (
        "1D2" in found.options,
        f"{found.maker} {found.model}, options {', '.join(found.options) or 'none'}",
    )


def _reset_zeroes(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    dialogue.send(f"SOUR:VOLT {day.level_vpk:g} VPK")
    dialogue.send("*RST")
    dialogue.send("*OPC")
    wait_until_done(dialogue, "reset", Deadline.after(_WAIT_S))
    dialogue.send("INIT:CONT OFF")
    dialogue.send("INST:SEL SINE")
    level = dialogue.ask_number("SOUR:VOLT?")
    dialogue.send("SOUR:VOLT 0 VPK")
    band = dialogue.ask_number("FREQ:STAR?"), dialogue.ask_number("FREQ:STOP?")
    return level == 0, f"level {level:g} after *RST; start and stop {band[0]:g} and {band[1]:g} Hz"


def _bare_level(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    # Half, for the instrument may take it as a root mean square.
    sent = f"{min(_BARE_V, day.level_vpk / 2):.4g}"
    dialogue.send(f"SOUR:VOLT {sent}")
    value, unit = dialogue.ask("SOUR:VOLT?"), dialogue.ask("SOUR:VOLT? UNIT")
    dialogue.send("SOUR:VOLT 0 VPK")
    dialogue.drain()
    return parse_string(unit).upper() == "VPK", f"{sent} reads back {value} {unit}"


def _units(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    wanted = {"SWE:STIM": "CYCLE", "SWE:DWEL": "CYCLE", "SOUR:VOLT:SLEW": "V", "FREQ:RES": "PNT",
              "VOLT1:RANG": "DBV", "VOLT2:RANG": "DBV"}  # fmt: skip
    found = {header: dialogue.ask(f"{header}? UNIT") for header in wanted}
    holds = all(parse_string(found[key]).upper().startswith(unit) for key, unit in wanted.items())
    return holds, ", ".join(f"{key} {unit}" for key, unit in found.items())


def _output_in_sine(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    dialogue.send("OUTP?")
    try:
        reply = dialogue.transport.read(Deadline.after(1.0))
    except LashbenchError:
        dialogue.clear()
        said = ", ".join(str(entry) for entry in dialogue.drain()) or "no error"
        return True, f"OUTP? is not answered in swept sine ({said})"
    dialogue.drain()
    return False, f"OUTP? answers {reply} in swept sine"


def _longest_dwell(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    taken = _refusal(dialogue, "SWE:DWEL 234 CYCLE")
    beyond = _refusal(dialogue, "SWE:DWEL 235 CYCLE")
    far = _refusal(dialogue, "SWE:DWEL 2000 CYCLE")
    return "error" in taken and "-222" in beyond, f"234: {taken}; 235: {beyond}; 2000: {far}"


def _refusals(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    wrong_mode = _refusal(dialogue, "AVER:COUN 5")
    for _ in range(8):
        dialogue.send("NOSUCH:HEADER 1")
    queue = dialogue.drain()
    seen = f"wrong mode: {wrong_mode}; after eight errors: {', '.join(map(str, queue))}"
    return "-2" in wrong_mode and len(queue) == 5, seen


def _user_enable(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _talk(day)
    dialogue.send("STAT:USER:ENAB 12345")
    found = dialogue.ask_integer("STAT:USER:ENAB?")
    dialogue.send("STAT:USER:ENAB 0")
    return found == 12345, f"12345 reads back {found}"


def _settings(day: FirstDay, integrate: int = 10) -> PointSettings:
    return PointSettings(day.level_vpk, 5, integrate, slew_vpk_per_s=1.0)


def _byte_order(day: FirstDay) -> tuple[bool | None, str]:
    read_back = day.analyser.prepare(*_BAND_HZ, _settings(day))
    return True, f"the X axis is a ramp in big-endian reals; {len(read_back)} settings read back"


def _points(day: FirstDay) -> tuple[bool | None, str]:
    day.analyser.prepare(*_BAND_HZ, _settings(day))
    began_s = time.monotonic()
    points = list(day.analyser.sweep((110.0, 150.0, 190.0)))
    each_s = (time.monotonic() - began_s) / len(points)
    day.kept["driven"] = points
    cycles_s = 15 / 150.0
    known = all(np.isfinite(point.gain) and abs(point.gain) > 0 for point in points)
    return known, (
        f"{each_s:.2f} s a point for {cycles_s:.2f} s of cycles; "
        + ", ".join(f"{p.frequency_hz:g} Hz {abs(p.gain):.4g}" for p in points)
    )


def _variance(day: FirstDay) -> tuple[bool | None, str]:
    figures = []
    for cycles in (10, 20):
        day.analyser.prepare(*_BAND_HZ, _settings(day, cycles))
        near = _MIDDLE_HZ + np.arange(_READINGS) / 64.0
        points = list(day.analyser.sweep(near.tolist()))
        gains = np.array([point.gain for point in points])
        told = [point.gain_std_db for point in points if point.gain_std_db is not None]
        scatter_db = 20 / np.log(10) * np.sqrt(normalised_variance(gains) / 2)
        noise = [sum(point.variances) for point in points if point.variances is not None]
        if not told or not noise:
            return None, "no normalised variance came"
        figures.append((float(scatter_db), float(np.median(told)), float(np.median(noise))))
    (scatter, bar, nv), (_, _, nv_longer) = figures
    if nv > _NOISY:
        return None, f"normalised variance {nv:.3g}: too noisy; measure a resistor divider"
    holds = 0.5 < scatter / bar < 2.0 and 0.5 < nv_longer / nv < 2.0
    return holds, (
        f"gain scatters by {scatter:.3g} dB, its error bar is {bar:.3g} dB; normalised variance "
        f"{nv:.3g} with 10 cycles, {nv_longer:.3g} with 20"
    )


def _both_ends(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    for line in ("FREQ:STAR 100 HZ", "FREQ:STOP 200 HZ", "FREQ:RES:AUTO OFF", "SWE:MODE AUTO",
                 "FREQ:RES 5 PNT/SWP", "SWE:STIM 5 CYCLE", "SWE:DWEL 5 CYCLE", "FORM REAL,64",
                 "CALC1:FEED 'XFR:POW:RAT 2,1'", f"SOUR:VOLT {day.level_vpk:g} VPK"):  # fmt: skip
        dialogue.send(line)
    dialogue.send("ABOR;:INIT;*OPC")
    wait_until_done(dialogue, "sweep of five points", Deadline.after(_WAIT_S))
    dialogue.send("TRAC D1,TRAC1")
    axis, pairs = dialogue.ask_reals("TRAC:X? D1"), dialogue.ask_reals("TRAC? D1")
    gains = pairs[0::2] + 1j * pairs[1::2]
    changes = np.flatnonzero(np.abs(np.diff(gains)) > 0)
    day.kept["ends"] = axis[-1]
    return None, (
        f"{len(axis)} displayed, axis {axis[0]:g} to {axis[-1]:g} Hz, values change after rows "
        f"{changes.tolist()[:8]}: five points over 401 rows; the last is at "
        f"{'the stop' if len(changes) and changes[-1] > 390 else 'a step before the stop'}"
    )


def _after_the_last(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day)
    for line in ("FREQ:STAR 100 HZ", "FREQ:STOP 200 HZ", "FREQ:RES:AUTO OFF",
                 "FREQ:RES 5 PNT/SWP", f"SOUR:VOLT {day.level_vpk:g} VPK"):  # fmt: skip
        dialogue.send(line)
    dialogue.send("ABOR;:INIT;*OPC")
    wait_until_done(dialogue, "sweep of five points", Deadline.after(_WAIT_S))
    done = day.drives("after the last point of a sweep")
    if done is None:
        return None, "not watched"
    dialogue.send("ABOR")
    aborted = day.drives("after ABOR")
    if aborted is None:
        return None, f"drives after the last point: {WORDS[done]}; after ABOR: not watched"
    seen = f"drives after the last point: {WORDS[done]}; after ABOR: {WORDS[aborted]}"
    return done and aborted, seen


CHECKS = (
    Check("identity", "a 35670A with option 1D2", "daq/hp35670a/identity.py", _identity),
    Check("safe-off", "the source is at rest after the recipe", "daq/hp35670a/safe.py", at_rest),
    Check("reset", "*RST zeroes the level that swept sine keeps", "daq/hp35670a/setup.py",
          _reset_zeroes, drives=True),
    Check("bare level", "a level without unit is V peak; the driver always sends one", _SETTINGS,
          _bare_level, drives=True),
    Check("units", "? UNIT answers for every setting in doubt", "daq/driving/settings.py", _units),
    Check("output switch", "OUTP? is refused in swept sine; the driver never asks there",
          "daq/hp35670a/safe.py", _output_in_sine),
    Check("longest integration", "234 cycles at most", _SETTINGS, _longest_dwell),
    Check("refusals", "-221 or -200 in the wrong mode; five entries in the queue",
          "daq/driving/scpi_connection.py", _refusals),
    Check("user enable", "keeps a number (bare sockets)", "daq/driving/scpi_connection.py",
    _user_enable), Check("byte order", "big-endian reals", "daq/hp35670a/trace.py", _byte_order),
    Check("manual points", "each start measures one point at FREQ:MAN", "daq/hp35670a/sweeps.py",
          _points, drives=True),
    Check("normalised variance", "scatter of single cycles, whatever their number",
          "daq/driving/variance.py", _variance, drives=True),
    Check("ends of a sweep", "nothing: the driver goes point by point",
          "daq/hp35670a/sweeps.py", _both_ends, drives=True),
    Check("after the last point", "the source goes on driving", "daq/hp35670a/safe.py",
          _after_the_last, drives=True),
    Check("safe-off in the end", "the source is at rest after all that drove",
          "daq/hp35670a/safe.py", at_rest),
)  # fmt: skip
"""In the order in which they are made; those that measure come last."""
