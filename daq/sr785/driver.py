"""The SR785 and SR780 in the table of drivers; see `daq.drivers`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.driving.entry import Driver

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.driving.first_day import Check
    from daq.plan import SweepPlan
    from daq.transports.base import Transport

__all__ = ["DRIVER"]


def _drive(transport: Transport) -> Analyser:
    from daq.sr785.analyser import SR785

    return SR785(transport)


def _check(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool,
) -> None:
    from daq.sr785.setup import check_sweep

    check_sweep(plan, slew_vpk_per_s, input_range_vpk)


def _first_day() -> tuple[Check, ...]:
    from daq.sr785.first_day import CHECKS

    return CHECKS


DRIVER = Driver(
    "Stanford Research SR785/SR780", "sr785", _drive, _check, ("SR785", "SR780"), 10, _first_day
)
