"""The sampled bench in the table of drivers; see `daq.drivers`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.driving.entry import Driver, Wire

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.driving.first_day import Check
    from daq.plan import SweepPlan
    from daq.transports.base import Transport

__all__ = ["DRIVER"]


def _drive(transport: Transport) -> Analyser:
    from daq.sampled.analyser import SampledBench

    return SampledBench(transport)


def _check(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool,
) -> None:
    from daq.sampled.limits import check_sweep

    check_sweep(plan, slew_vpk_per_s, input_range_vpk)


def _open_sound(rest: str) -> Transport:
    from daq.sampled.sound import open_sound

    return open_sound(rest)


def _open_nidaq(rest: str) -> Transport:
    from daq.sampled.nidaq import open_nidaq

    return open_nidaq(rest)


def _load_sound() -> None:
    import daq.sampled.sound  # noqa: F401


def _load_nidaq() -> None:
    import daq.sampled.nidaq  # noqa: F401


def _first_day() -> tuple[Check, ...]:
    from daq.sampled.first_day import CHECKS

    return CHECKS


DRIVER = Driver(
    "sampled bench",
    "sampled",
    _drive,
    _check,
    ("SAMPLED",),
    12,
    _first_day,
    wires={"sound": Wire(_open_sound, _load_sound), "nidaq": Wire(_open_nidaq, _load_nidaq)},
)
