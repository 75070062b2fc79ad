"""What the driver of the SR785 assumes, as checks on a real instrument.

Owns the list of `docs/sr785.md` as far as a program can look at it. A check that sets a level says
that it drives, and is followed by the safe-off recipe.
"""

from __future__ import annotations

import math
import time

import numpy as np

from daq.analyser import PointSettings
from daq.driving.first_day import WORDS, Check, FirstDay, NotAtRest, at_rest
from daq.driving.variance import normalised_variance
from daq.errors import BenchTimeout, LashbenchError
from daq.plan import spaced_frequencies
from daq.sr785.dialogue import RS232, Dialogue
from daq.sr785.settings import MODELS
from daq.sr785.setup import enter_swept_sine

__all__ = ["CHECKS"]

_BAND_HZ = (100.0, 1000.0)
_SWEEP_S = 120.0
_POINTS = 11
_NOISY = 0.1
"""Normalised variance above which its scale cannot be told."""


def _talk(day: FirstDay) -> Dialogue:
    dialogue = Dialogue(day.transport)
    dialogue.on_exchange, dialogue.on_wait = day.analyser.on_exchange, day.analyser.on_wait
    return dialogue


def _swept(day: FirstDay, start: float, stop: float, points: int) -> Dialogue:
    """In swept sine, a sweep set up, nothing driving."""
    dialogue = _talk(day)
    numbers = MODELS[str(day.kept.get("model", "SR785"))]
    enter_swept_sine(dialogue, numbers)
    for line in ("SRPT 2,0", "SSTY 2,0", f"SSTR 2,{start:.6f}", f"SSTP 2,{stop:.6f}",
                 f"SNPS 2,{points}", "SSCY 2,5", "SICY 2,5", f"MEAS 2,{numbers.response}",
                 "VIEW 0,3", "VIEW 1,4"):  # fmt: skip
        dialogue.command(line)
    return dialogue


def _drive(day: FirstDay, dialogue: Dialogue) -> None:
    """Run the sweep to its end at the level of the day, then switch off."""
    dialogue.command(f"SSAM {1000 * day.level_vpk:g} mV")
    dialogue.ask("DSPS?")
    dialogue.command("SRCO 1")
    dialogue.command("STRT")
    until_s = time.monotonic() + _SWEEP_S
    while not dialogue.ask_integer("DSPS? 4"):
        if time.monotonic() > until_s:
            raise dialogue.failure(BenchTimeout(f"the sweep did not end in {_SWEEP_S:g} s"))
        dialogue.pause(0.1)
    dialogue.command("SRCO 0")


def _identity(day: FirstDay) -> tuple[bool | None, str]:
    found = day.analyser.identify()
    day.kept["model"] = found.model
    return found.model == "SR785", f"{found.maker} {found.model}, serial {found.serial}"


def _levels(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day, *_BAND_HZ, _POINTS)
    found = []
    # Rounded down: none is above the highest level of the day.
    decibels = math.floor(200 * math.log10(day.level_vpk)) / 10
    for sent in (f"{1000 * day.level_vpk:g} mV", f"{day.level_vpk:g} V", f"{decibels:g} dBVpk"):
        try:
            dialogue.command(f"SSAM {sent}")
            found.append(f"{sent} reads back {dialogue.ask('SSAM?')}")
        except LashbenchError as error:
            found.append(f"{sent} is refused ({error})")
    dialogue.command("SSAM 0 mV")
    taken = not any("is refused" in one for one in found)
    return taken, "; ".join(found)


def _switch(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day, *_BAND_HZ, _POINTS)
    dialogue.command(f"SSAM {1000 * day.level_vpk:g} mV")
    dialogue.command("SRCO 0")
    dialogue.command("STRT")
    off = day.drives("a sweep runs with SRCO 0")
    if off:
        raise NotAtRest(
            "instrument and person disagree: SRCO 0 switches it off, the person at the bench sees "
            "the source drive in a sweep"
        )
    dialogue.command("PAUS")
    if off is None:
        return None, "not watched"
    dialogue.command("SRCO 1")
    dialogue.command("STRT")
    on = day.drives("a sweep runs with SRCO 1")
    dialogue.command("SRCO 0")
    dialogue.command("PAUS")
    if on is None:
        return None, f"drives with SRCO 0: {WORDS[off]}; with SRCO 1: not watched"
    return on, f"drives with SRCO 0: {WORDS[off]}; with SRCO 1: {WORDS[on]}"


def _order_of_bins(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _swept(day, _BAND_HZ[1], _BAND_HZ[0], _POINTS)
    _drive(day, dialogue)
    bins = [dialogue.ask_number(f"DBIN? 0,{bin}") for bin in (0, _POINTS - 1)]
    values = [dialogue.ask_number(f"DSPY? 0,{bin}") for bin in (0, _POINTS - 1)]
    length = dialogue.ask_integer("DSPN? 0")
    return None, f"down: bin 0 at {bins[0]:g} Hz, last at {bins[1]:g} Hz; {values}; {length} bins"


def _bytes(day: FirstDay) -> tuple[bool | None, str]:
    dialogue = _talk(day)
    if dialogue.interface == RS232:
        return None, "RS-232 has no binary traces"
    dialogue.recover()
    text = dialogue.ask_number("DSPY? 0,3")
    count = dialogue.ask_integer("DSPN? 0")
    value = float(dialogue.ask_floats("DSPB? 0", count)[3])
    dialogue.finish("DSPB? 0", dialogue.reply_s)
    return abs(value - text) <= 1e-5 * abs(text), f"DSPY? says {text:g}, DSPB? {value:g}"


def _measurement_kept(day: FirstDay) -> tuple[bool | None, str]:
    numbers = MODELS[str(day.kept.get("model", "SR785"))]
    if numbers.variances is None:
        return None, "this model has no normalised variance"
    dialogue = _swept(day, *_BAND_HZ, _POINTS)
    _drive(day, dialogue)
    before = dialogue.ask_number("DSPY? 0,3")
    view = dialogue.ask("VIEW? 1")
    dialogue.command(f"MEAS 1,{numbers.variances[0]}")
    variance = dialogue.ask_number("DSPY? 1,3")
    dialogue.command(f"MEAS 1,{numbers.response}")
    after, moved = dialogue.ask_number("DSPY? 0,3"), dialogue.ask("VIEW? 1")
    kept = before == after and variance > -3.4e38
    return kept, f"variance {variance:g}; display A {before:g} and {after:g}; view {view}, {moved}"


def _narrow(day: FirstDay) -> tuple[bool | None, str]:
    day.analyser.prepare(*_BAND_HZ, PointSettings(day.level_vpk, 5, 5, slew_vpk_per_s=1.0))
    (point,) = day.analyser.sweep((300.0,))
    near = abs(point.frequency_hz - 300.0) <= 0.03
    return near, f"asked for 300 Hz, measured at {point.frequency_hz:.6g} Hz, gain {point.gain:.4g}"


def _sweep(day: FirstDay) -> tuple[bool | None, str]:
    day.analyser.prepare(*_BAND_HZ, PointSettings(day.level_vpk, 5, 5, slew_vpk_per_s=1.0))
    points = list(day.analyser.sweep(spaced_frequencies(*_BAND_HZ, _POINTS)))
    known = all(np.isfinite(point.gain) for point in points)
    return known, ", ".join(f"{p.frequency_hz:g} Hz {abs(p.gain):.4g}" for p in points)


def _variance(day: FirstDay) -> tuple[bool | None, str]:
    figures = []
    for cycles in (4, 16):
        settings = PointSettings(day.level_vpk, 5, cycles, slew_vpk_per_s=1.0)
        day.analyser.prepare(*_BAND_HZ, settings)
        points = list(day.analyser.sweep(spaced_frequencies(299.0, 301.0, 21)))
        gains = np.array([point.gain for point in points])
        told = [point.gain_std_db for point in points if point.gain_std_db is not None]
        noise = [sum(point.variances) for point in points if point.variances is not None]
        if not told or not noise:
            return None, "no normalised variance came"
        scatter_db = 20 / np.log(10) * np.sqrt(normalised_variance(gains) / 2)
        figures.append((float(scatter_db), float(np.median(told)), float(np.median(noise))))
    (scatter, bar, nv), (_, _, nv_longer) = figures
    if nv > _NOISY:
        return None, f"normalised variance {nv:.3g}: too noisy; measure a resistor divider"
    holds = 0.5 < scatter / bar < 2.0 and 0.5 < nv_longer / nv < 2.0
    return holds, (
        f"gain scatters by {scatter:.3g} dB, its error bar is {bar:.3g} dB; normalised variance "
        f"{nv:.3g} with 4 cycles, {nv_longer:.3g} with 16"
    )


CHECKS = (
    Check("identity", "an SR785; an SR780 has other numbers", "daq/sr785/settings.py", _identity),
    Check("safe-off", "the source is at rest after the recipe", "daq/sr785/safe.py", at_rest),
    Check("levels", "mV, V and dBVpk are taken, and answered with a unit",
          "daq/sr785/levels.py", _levels, drives=True),
    Check("output switch", "a swept sine obeys SRCO", "daq/sr785/safe.py", _switch, drives=True),
    Check("order of bins", "nothing: each bin's frequency is read", "daq/sr785/traces.py",
          _order_of_bins, drives=True),
    Check("byte order", "little-endian floats", "daq/sr785/traces.py", _bytes),
    Check("change of MEAS", "the data of a sweep stand there still", "daq/sr785/sweeps.py",
          _measurement_kept, drives=True),
    Check("narrow sweep", "ten points over one part in ten thousand are taken",
          "daq/sr785/plan.py", _narrow, drives=True),
    Check("sweep", "evenly spaced points in one sweep", "daq/sr785/sweeps.py", _sweep,
          drives=True),
    Check("normalised variance", "scatter of single cycles, whatever their number",
          "daq/driving/variance.py", _variance, drives=True),
    Check("safe-off in the end", "the source is at rest after all that drove",
          "daq/sr785/safe.py", at_rest),
)  # fmt: skip
"""In the order in which they are made."""
