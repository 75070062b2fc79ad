"""Unit files of drives that are not the paper's, as mappings: ADSS with sections of its own."""

import copy
import tomllib

import numpy as np

from daq.configs import config_path
from sim.unit import unit_from_mapping

FINE = 4e6
ENCODER = {"kind": "encoder", "counts": 4096.0}
CURRENT = {"kind": "current", "bandwidth_hz": 1000.0, "current_limit_a": 1.6}
COUPLINGS = {
    "motor_coupling": {"k_cm": 50.0, "c_cm": 1e-3, "J_cm": 1e-6},
    "load_coupling": {"k_cL": 3000.0, "c_cL": 0.1, "J_cL": 1e-4},
}
SAMPLED = {"rate_hz": 2000.0}
MOTOR_ACCELEROMETER = {"kind": "accelerometer", "low_pass_hz": 500.0}
LOAD_ACCELEROMETER = {
    "kind": "accelerometer", "at": "load", "radius_m": 0.05, "low_pass_hz": 1000.0,
    "high_pass_hz": 0.5,
}  # fmt: skip
"""Mounted tangentially; 0.0102 V per m/s^2 are 100 mV/g."""

DRIVES = {
    "command held": {"sampling": SAMPLED},
    "encoder, speed": {"sampling": SAMPLED, "sensor": ENCODER | {"delay_s": 5e-4}, "filter": None},
    "encoder, position": {
        "sampling": SAMPLED | {"holds_command": False},
        "sensor": ENCODER | {"reads": "position"},
        "filter": None,
    },
    "encoder, held and filtered": {"sampling": SAMPLED, "sensor": ENCODER | {"held": True}},
    "encoder at the load": {
        "sampling": SAMPLED,
        "sensor": ENCODER | {"at": "load", "counts": 4e6},
        "filter": None,
    },
    "tachometer sampled": {
        "sampling": {"rate_hz": 1000.0},
        "sensor": {"kind": "tachometer", "sampled": True},
    },
    "accelerometer at the load": {"sensor": LOAD_ACCELEROMETER, "electronics": {"k_ts": 0.0102}},
    "accelerometer behind the filter": {
        "sensor": {"kind": "accelerometer"},
        "electronics": {"k_ts": 1e-4},
    },
    "accelerometer sampled": {
        "sampling": SAMPLED,
        "sensor": MOTOR_ACCELEROMETER | {"sampled": True, "delay_s": 2e-4},
        "electronics": {"k_ts": 1e-4},
        "filter": None,
    },
    "motor current": {
        "sensor": {"kind": "current", "low_pass_hz": 2000.0, "high_pass_hz": 0.5},
        "electronics": {"k_ts": 0.4},
        "filter": None,
    },
    "current": {"amplifier": CURRENT, "electronics": {"k_a": 1.0}, "sampling": SAMPLED},
    "couplings": COUPLINGS,
    "damped": {"damping": {"B_L": 0.02, "c_s1": 3e-3, "c_g1": 0.02, "c_2": 0.3}},
    "three stages": {
        "stage3": {"J_g2": 3e-5, "N_3": 2.0, "k_3": 5e4, "b3_deg": 0.02},
        "damping": {"c_3": 0.3, "c_2": 0.1, "c_s1": 3e-3},
    },
}
"""Sections to add by what they are; ``filter`` None takes the filter away."""

SPEED = {"controls": "speed", "K_p": 1.0, "T_i_s": 0.02}
LOOPS = {
    "speed, reference": {"loop": SPEED},
    "speed, command": {"loop": SPEED | {"excited": "command", "filtered": True, "K_p": 0.3}},
    "speed at a clock": {"loop": SPEED, "sampling": SAMPLED},
    "speed by an encoder": DRIVES["encoder, speed"]
    | {
        "amplifier": CURRENT,
        "electronics": {"k_a": 1.0},
        "sensor": ENCODER | {"delay_s": 5e-4, "counts": 65536.0},
        "loop": SPEED | {"computing_s": 5e-4},
    },
    "position": {
        "sampling": SAMPLED,
        "sensor": ENCODER | {"reads": "position", "counts": 65536.0},
        "filter": None,
        "loop": {"controls": "position", "K_p": 1.0, "T_i_s": 0.02, "K_v": 40.0},
    },
}
"""The same with a loop closed around them."""


def document(sections, base="adss", free=False):
    """The parsed unit file; `free`: without friction and play, so that it is linear."""
    kind = "templates" if base.endswith("-stage") else "units"
    found = tomllib.loads(config_path(kind, base).read_text(encoding="utf-8"))
    found.pop("tolerance", None)
    for name, section in copy.deepcopy(sections).items():
        if name == "filter":
            for key in ("filter_numerator", "filter_denominator"):
                del found["electronics"][key]
        else:
            found[name] = found.get(name, {}) | section
    if "amplifier" in sections:
        for key in ("L_a", "R_m", "k_b"):
            found["motor"].pop(key)
    if free:
        found["motor"]["T_f_m"] = found["load"]["T_f_L"] = found["backlash"]["b_t_deg"] = 0.0
    return found


def finely(sections):
    """The same drive with an encoder so fine that it hardly counts, and no clip."""
    found = {name: dict(section) if section else section for name, section in sections.items()}
    if "counts" in found.get("sensor", {}):
        found["sensor"]["counts"] = FINE
    found.get("amplifier", {}).pop("current_limit_a", None)
    # What the undamped train keeps of its start would hide small errors.
    found["load_coupling"] = {"k_cL": 3000.0, "c_cL": 0.5, "J_cL": 1e-4}
    return found


def unit(sections, base="adss", free=False):
    """The unit of such a file."""
    return unit_from_mapping(document(sections, base, free), "drive.toml")


def cycles(read):
    """Gains (levels, points, cycles) of the plant as `sim.reading` takes them: one harmonic."""
    found = np.zeros((*np.shape(read), 4), dtype=complex)
    found[..., 1] = read
    return found
