"""The linear response of a drive of one to three gear stages, worked out by hand."""

import numpy as np


def chain(unit, frequency_hz):
    """V_o/V_i from the load backwards, each piece as what the next one feels of it."""
    m, e, a = unit.motor, unit.electronics, unit.stage1
    s = 2j * np.pi * frequency_hz

    def through(stiffness, beyond):
        return 1.0 / (1.0 / stiffness + 1.0 / beyond)

    felt = unit.load.J_L * s**2
    if (c := unit.stage3) is not None:
        felt = c.J_g2 * s**2 + through(c.k_3, felt) / c.N_3**2
    if (b := unit.stage2) is not None:
        felt = a.J_p2 * s**2 + through(b.k_2, felt) / b.N**2
    felt = a.J_s1 * s**2 + through(2.0 * a.k_s1, felt)
    felt = a.J_g1 * s**2 + through(2.0 * a.k_s1, felt)
    felt = m.J_m * s**2 + m.B_m * s + through(a.k_g1, felt) / a.N_1**2
    theta = m.k_t * e.k_a / (felt * (m.L_a * s + m.R_m) + m.k_t * m.k_b * s)
    d2, d1, d0 = e.filter_denominator
    return e.filter_numerator / (d2 * s**2 + d1 * s + d0) * e.k_ts * s * theta
