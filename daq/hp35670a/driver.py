"""The 35670A in the table of drivers, where it is the preset; see `daq.drivers`."""

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
    from daq.hp35670a.analyser import HP35670A

    return HP35670A(transport)


def _check(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool,
) -> None:
    from daq.hp35670a.setup import check_sweep

    check_sweep(plan, slew_vpk_per_s, input_range_vpk, may_repeat=may_repeat)


def _first_day() -> tuple[Check, ...]:
    from daq.hp35670a.first_day import CHECKS

    return CHECKS


DRIVER = Driver("HP/Agilent 35670A", "", _drive, _check, ("35670A",), 11, _first_day)
