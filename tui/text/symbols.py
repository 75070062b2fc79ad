"""What symbols of parameters stand for, and their units as they are printed.

Owns these names; the symbols are the paper's.
"""

from __future__ import annotations

__all__ = ["named_symbol", "printed_unit"]

_NAMES = {
    "B_L": "load damping",
    "B_m": "motor friction, viscous",
    "J_L": "load inertia",
    "J_g2": "inertia of gear 2",
    "J_cL": "inertia before the load's coupling",
    "J_cm": "inertia behind the motor's coupling",
    "J_m": "motor inertia",
    "J_p": "payload inertia",
    "K_c": "cable stiffness",
    "K_p": "gain of the controller",
    "K_v": "gain of the position controller",
    "N_1": "ratio of stage 1",
    "N_3": "ratio of stage 3",
    "R_m": "motor resistance",
    "T_b": "load torque, constant",
    "T_i_s": "integral time",
    "T_d": "delay of the reading",
    "T_f_L": "load friction, dry",
    "T_f_m": "motor friction, dry",
    "T_s_L": "load friction, static part",
    "V_d": "dead zone",
    "V_sat": "voltage limit",
    "b3_deg": "backlash of stage 3",
    "b_t_deg": "total backlash",
    "bandwidth_hz": "bandwidth of the current loop",
    "c_2": "damping of mesh 2",
    "c_3": "damping of mesh 3",
    "c_cL": "damping of the load's coupling",
    "c_cm": "damping of the motor's coupling",
    "c_g1": "damping of mesh 1",
    "c_s1": "damping of shaft 1",
    "computing_s": "computing time",
    "delay_s": "delay of the loop",
    "eta_1": "efficiency of stage 1",
    "eta_2": "efficiency of stage 2",
    "eta_3": "efficiency of stage 3",
    "f_p": "payload frequency",
    "h": "hardening",
    "high_pass_hz": "lower corner of the sensor",
    "k_2": "stiffness of mesh 2",
    "k_3": "stiffness of mesh 3",
    "k_a": "amplifier gain",
    "k_cL": "stiffness of the load's coupling",
    "k_cm": "stiffness of the motor's coupling",
    "k_g1": "stiffness of mesh 1",
    "k_s1": "stiffness of shaft 1",
    "k_ts": "tachometer gain",
    "low_pass_hz": "upper corner of the sensor",
    "omega_s": "Stribeck rate",
    "scale": "factor",
    "tau_a": "amplifier time constant",
    "zeta_p": "payload damping ratio",
}


def named_symbol(symbol: str) -> str:
    """A symbol behind its name; alone where it has none here."""
    name = _NAMES.get(symbol)
    return symbol if name is None else f"{name} {symbol}"


def printed_unit(unit: str) -> str:
    """A unit after its number; empty for a plain number."""
    if unit in ("", "1"):
        return ""
    return " " + unit.replace(".", "\u00b7").replace("^2", "\u00b2")
