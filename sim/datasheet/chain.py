"""The chain from motor to load as a person checks it: ratios, inertias, natural frequencies.

Owns the undamped linear modes of a unit and its description in words. It steps no motion and
judges nothing (`sim.datasheet.plausibility`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.datasheet.stability import gain_margin, loop_features
from sim.drive.sections import Loop, Sensor
from sim.drive.unit import Unit
from sim.drivetrain import paper_drivetrain
from sim.elements import Inertia, Mesh, Spring
from sim.engine.system import Assembly

__all__ = ["NaturalFrequencies", "describe_chain", "inertias_at_motor", "loop_words",
           "natural_frequencies"]  # fmt: skip


@dataclass(frozen=True, slots=True)
class NaturalFrequencies:
    """Undamped modes with every mesh closed and no friction, Hz, lowest first.

    Backlash lowers the frequencies that a sweep shows.
    """

    anti_resonances_hz: tuple[float, ...]
    """With the motor held: zeros of the response of the motor's speed."""
    resonances_hz: tuple[float, ...]
    """With the motor free."""


def natural_frequencies(unit: Unit) -> NaturalFrequencies:
    """Linear anti-resonances and resonances of a unit's mechanics."""
    assembly = Assembly()
    for element in paper_drivetrain(unit, 1.0).elements.values():
        if isinstance(element, (Inertia, Spring, Mesh)):
            element.enter(assembly)
    energy = assembly.build(output={"th_m": 1.0}).energy
    n = len(assembly.inertias)
    stiffness, inertia = energy[:n, :n], np.diag(energy)[n:]
    held = [i for i, name in enumerate(assembly.inertias) if name != "th_m"]
    return NaturalFrequencies(
        _modes_hz(stiffness[np.ix_(held, held)], inertia[held]),
        _modes_hz(stiffness, inertia)[1:],  # the first is the turning of the whole
    )


def inertias_at_motor(unit: Unit) -> dict[str, float]:
    """Inertia of each part as the motor feels it, kg.m^2, from motor to load."""
    stage1, first, whole = unit.stage1, unit.stage1.N_1, unit.stage1.N_1 * unit.output_ratio
    parts = {
        "motor": unit.motor.J_m,
        "gear 1": stage1.J_g1 / first**2,
        "shaft 1": stage1.J_s1 / first**2,
    }
    if unit.motor_coupling is not None:
        parts["pinion 1"] = unit.motor_coupling.J_cm
    if stage1.J_p2 is not None:
        parts["pinion 2"] = stage1.J_p2 / first**2
    if unit.stage2 is not None and unit.stage3 is not None:
        parts["gear 2"] = unit.stage3.J_g2 / (first * unit.stage2.N) ** 2
    if unit.load_coupling is not None:
        parts["hub"] = unit.load_coupling.J_cL / whole**2
    return parts | {"load": unit.load.J_L / whole**2}


def describe_chain(unit: Unit) -> list[str]:
    """The drive from motor to load in lines of text of at most 80 characters."""
    stage1, stage2, ratio = unit.stage1, unit.stage2, unit.stage1.N_1 * unit.output_ratio
    lines = [*_drive_lines(unit), f"motor      J_m {unit.motor.J_m:.4g} kg.m^2"]
    if (coupling := unit.motor_coupling) is not None:
        lines.append(f"  coupling k_cm {coupling.k_cm:.4g} N.m/rad")
    lines += [
        f"  stage 1  {stage1.N_1:.5g} : 1, mesh k_g1 {stage1.k_g1:.4g} N.m/rad",
        *_efficiency(stage1.eta_1),
        f"shaft 1    k_s1 {stage1.k_s1:.4g} N.m/rad",
    ]
    if stage2 is not None:
        lines.append(f"  stage 2  {stage2.N:.5g} : 1, mesh k_2 {stage2.k_2:.4g} N.m/rad")
        lines += _efficiency(stage2.eta_2)
    if (stage3 := unit.stage3) is not None:
        lines.append(f"gear 2     J_g2 {stage3.J_g2:.4g} kg.m^2")
        lines.append(f"  stage 3  {stage3.N_3:.5g} : 1, mesh k_3 {stage3.k_3:.4g} N.m/rad")
        lines += _efficiency(stage3.eta_3)
    if (last := unit.load_coupling) is not None:
        lines.append(f"  coupling k_cL {last.k_cL:.4g} N.m/rad")
    lines.append(f"load       J_L {unit.load.J_L:.4g} kg.m^2")
    parts = inertias_at_motor(unit)
    total, play = sum(parts.values()), unit.backlash.b_t_deg
    lines += [
        "",
        f"ratio from motor to load: {ratio:.5g}",
        "inertia that the motor turns:",
        *(f"  {part:<9}{J:.3e} kg.m^2 {100.0 * J / total:5.1f} %" for part, J in parts.items()),
        f"  {'total':<9}{total:.3e} kg.m^2",
        f"total backlash: {play:.4g} deg at the load, {play * ratio:.4g} deg at the motor",
        *([] if stage3 is None else [f"  of it {stage3.b3_deg:.4g} deg in stage 3"]),
        *_frequency_lines(unit),
        *([] if unit.loop is None else _loop_lines(unit)),
    ]
    return lines


def _efficiency(eta: float | None) -> list[str]:
    """That of a stage, where it is stated; up to 0.5 its gear cannot drive its pinion."""
    if eta is None:
        return []
    locks = ", self-locking: its gear cannot drive it" if eta <= 0.5 else ""
    return [f"           efficiency {eta:.3g}{locks}"]


def _drive_lines(unit: Unit) -> list[str]:
    """Amplifier, clock and sensor, where they are not those of the paper."""
    lines = []
    if (current := unit.amplifier) is not None:
        most = current.current_limit_a
        limit = "" if most is None else f", at most {most:g} A"
        lines.append(f"amplifier  controls the current, to {current.bandwidth_hz:g} Hz{limit}")
    if (clock := unit.sampling) is not None:
        held = "held" if clock.holds_command else "continuous"
        lines.append(f"clock      {clock.rate_hz:g} Hz, command {held}")
    if (sensor := unit.sensor) is not None:
        counts = "" if sensor.counts is None else f", {sensor.counts:.0f} counts a turn"
        late = f", {1e3 * sensor.delay_s:g} ms late" if sensor.delay_s else ""
        where = "of the motor" if sensor.kind == "current" else f"at the {sensor.at}"
        read = "" if sensor.kind in ("accelerometer", "current") else f", {sensor.reads}"
        lines.append(f"sensor     {sensor.kind} {where}{read}{counts}{late}")
        lines += _band_lines(sensor)
    if unit.loop is not None:
        gains, source = loop_words(unit.loop)
        lines += [f"loop       {gains}", f"           {source}"]
    return lines


def loop_words(loop: Loop) -> tuple[str, str]:
    """What a controller controls, with its gains, and where the source is added."""
    outer = "" if loop.K_v is None else f"K_v {loop.K_v:.4g} 1/s, "
    inner = "" if loop.T_i_s is None else f", T_i {loop.T_i_s:.4g} s"
    late = f", {1e3 * loop.computing_s:g} ms to compute" if loop.computing_s else ""
    gains = f"{loop.controls}, {outer}K_p {loop.K_p:.4g}{inner}{late}"
    return gains, f"the source is {_EXCITED[loop.excited]}"


_EXCITED = {"reference": "its reference", "command": "added to its command"}


def _loop_lines(unit: Unit) -> list[str]:
    """What the closed loop makes of it."""
    found, margin = loop_features(unit), gain_margin(unit)
    if margin is None:
        stable = "stable at any K_p"
    else:
        stable = f"stable up to {margin:.3g} times its K_p" if margin >= 1.0 else "unstable"
    arf = "no ARF" if found.arf_hz is None else f"ARF {found.arf_hz:.4g} Hz"
    rf = "no RF" if found.rf_hz is None else f"RF {found.rf_hz:.4g} Hz, {found.rf_db:.3g} dB"
    return [
        f"closed loop, linear: {stable}, meshes closed or open",
        f"  shows {arf}, {rf}",
    ]


def _band_lines(sensor: Sensor) -> list[str]:
    """Mounting and corners of a sensor, where it has any."""
    told = (
        (sensor.radius_m, "at {:g} m from the axis"),
        (sensor.high_pass_hz, "from {:g} Hz"),
        (sensor.low_pass_hz, "up to {:g} Hz"),
    )
    words = ", ".join(text.format(value) for value, text in told if value is not None)
    return [f"           {words}"] if words else []


def _frequency_lines(unit: Unit) -> list[str]:
    found, limits = natural_frequencies(unit), unit.limits
    further = (*found.anti_resonances_hz[1:], *found.resonances_hz[1:])
    lines = [
        "linear, meshes closed and undamped (backlash lowers both):",
        f"  ARF {found.anti_resonances_hz[0]:.4g} Hz, RF {found.resonances_hz[0]:.4g} Hz",
    ]
    if further:
        lines.append(f"  further ones from {min(further):.4g} Hz")
    return [*lines, f"limits: {limits.start_hz:g} to {limits.stop_hz:g} Hz, "
            f"{limits.source_vpk:g} V peak"]  # fmt: skip


def _modes_hz(stiffness: NDArray[np.float64], inertia: NDArray[np.float64]) -> tuple[float, ...]:
    scale = 1.0 / np.sqrt(inertia)
    squares = np.linalg.eigvalsh(scale[:, None] * stiffness * scale)
    return tuple(float(w) for w in np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))
