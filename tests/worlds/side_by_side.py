"""The engine and the oracle, asked the same question in the same words; for the tests alone."""

import numpy as np
from oracle import rk4

from sim.effects import drivetrain_with
from sim.engine.engine import Stretch, advance
from sim.unit import load_unit, stage_backlash

ADSS, EDSS = load_unit("adss"), load_unit("edss")
FRICTIONLESS = {"T_f_m": 0.0, "T_f_L": 0.0}


def state_space(unit, c_s1=0.0, B_L=0.0, K_c=0.0):
    """Equations (1) to (14) without play and dry friction, by hand.

    States: i_a, then angle and rate of motor, gear 1, shaft middle, pinion 2 and load, then
    V_o and its rate.
    """
    p = unit.parameters
    A, B = np.zeros((13, 13)), np.zeros((13, 1))
    B[0] = p["k_a"] / p["L_a"]
    A[0, 0], A[0, 2] = -p["R_m"] / p["L_a"], -p["k_b"] / p["L_a"]
    for angle in (1, 3, 5, 7, 9):
        A[angle, angle + 1] = 1.0
    T_g1 = np.zeros(13)
    T_g1[[1, 3]] = p["k_g1"] / p["N_1"], -p["k_g1"]
    T_L = np.zeros(13)
    T_L[[7, 9]] = p["k_2"] / p["N"], -p["k_2"]
    T_a, T_c = np.zeros(13), np.zeros(13)
    T_a[[3, 5, 4, 6]] = 2 * p["k_s1"], -2 * p["k_s1"], 2 * c_s1, -2 * c_s1
    T_c[[5, 7, 6, 8]] = 2 * p["k_s1"], -2 * p["k_s1"], 2 * c_s1, -2 * c_s1
    A[2] -= T_g1 / p["N_1"] / p["J_m"]
    A[2, 0] += p["k_t"] / p["J_m"]
    A[2, 2] -= p["B_m"] / p["J_m"]
    A[4] = (T_g1 - T_a) / p["J_g1"]
    A[6] = (T_a - T_c) / p["J_s1"]
    A[8] = (T_c - T_L / p["N"]) / p["J_p2"]
    A[10] = T_L / p["J_L"]
    A[10, 10] -= B_L / p["J_L"]
    A[10, 9] -= K_c / p["J_L"]
    A[11, 12] = 1.0
    A[12, 2], A[12, 11], A[12, 12] = 723439.0 * p["k_ts"], -723439.0, -1710.0
    C = np.zeros((1, 13))
    C[0, 11] = 1.0
    import control  # it loads matplotlib; most who draw on this file need neither

    return control.ss(A, B, C, 0.0)


def half_plays(unit, ratio):
    return stage_backlash(ratio, unit.backlash.b_t_deg, unit.stage2.N).half_plays_rad


def law_parameters(system, lanes=1):
    one = np.array([law.parameters for law in system.nonlinearities]).reshape(-1, 3, 1)
    return np.repeat(one, lanes, axis=-1)


def drive(system, state, frequency_hz, cycles, amplitude=0.0, offset=0.0, step_s=5e-6, settle=0,
          parameters=None, single=False, modes=None):  # fmt: skip
    """Coefficients (cycles, 4, lanes) in V, and the state at the end (n, lanes)."""
    state = np.array(state, dtype=float).reshape(len(system.states), -1)
    lanes = state.shape[1]
    one = np.ones(lanes)
    stretch = Stretch(frequency_hz, amplitude * one, 0.0 * one, offset * one, settle, cycles)
    if parameters is None:
        parameters = law_parameters(system, lanes)
    (motion,) = advance(system, parameters, state, [stretch], step_s, single, modes)
    return motion.coefficients, motion.state


def rows_of(system, **coordinates):
    """A state (n,) with some of its entries set; names with `_rate` mean a velocity."""
    state = np.zeros(len(system.states))
    for name, value in coordinates.items():
        state[system.states.index(name.replace("_rate", "'"))] = value
    return state


def engine_gain(unit, ratio, frequency_hz, level, settle, cycles, effects=(), offset=0.0,
                step_s=5e-6, single=False):  # fmt: skip
    """Per-cycle V_o over the level (cycles, 4) from zeros, as the oracle gives it."""
    system = drivetrain_with(unit, ratio, effects).system()
    start = np.zeros(len(system.states))
    kept, _ = drive(
        system, start, frequency_hz, cycles, level, offset, step_s, settle, single=single
    )
    return kept[..., 0] / level


def oracle_gain(unit, ratio, frequency_hz, level, settle, cycles, extras=None, offset=0.0,
                step_s=2e-6):  # fmt: skip
    kept, _ = rk4.simulate_cycles(
        unit.parameters, *half_plays(unit, ratio), level, frequency_hz, settle + cycles, step_s,
        None, extras, offset,
    )  # fmt: skip
    return kept[settle:]


def departure(one, other):
    """How far two phasors are apart: dB and degrees."""
    quotient = one / other
    return abs(20.0 * np.log10(abs(quotient))), abs(np.degrees(np.angle(quotient)))
