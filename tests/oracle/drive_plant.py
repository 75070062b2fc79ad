"""A second oracle: drives that are not the paper's, written out by hand and stepped by RK4.

Owns an independent answer for current-controlled amplifiers, couplings, one or two stages, and a
bench with a clock: command held, encoder or tachometer sampled, readings late, and a speed or
position loop around all that; accelerometers and current sensors, continuous or sampled. Nothing is
linearised: counts are counted, a delay is a wait, and an acceleration is the sum of torques over an
inertia. It must never import a module of the project but for the compiler's decorator, and takes a
parsed unit file as it stands. It has more than 400 lines since numba's cache on disk looks at one
file alone to tell whether it is stale: what the numbers are stands beside what steps them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sim.engine.compiling import njit


class Plant(NamedTuple):
    """Every number; SI, half plays in rad. A missing coupling is locked, k = 0.

    `loss_1`, `loss_2`: torque lost on a pinion over that which the mesh passes on to it.
    `sense`: 0 speed or angle, 1 acceleration, 2 current; `low`, `high`: corners, rad/s, 0 for none.
    """

    current: bool
    L_a: float
    R_m: float
    k_b: float
    k_t: float
    k_a: float
    i_max: float
    J_m: float
    B_m: float
    T_f_m: float
    k_cm: float
    c_cm: float
    J_cm: float
    N_1: float
    k_g1: float
    J_g1: float
    k_s1: float
    J_s1: float
    two: bool
    J_p2: float
    N: float
    k_2: float
    k_cL: float
    c_cL: float
    J_cL: float
    J_L: float
    T_f_L: float
    B_L: float
    c_s1: float
    c_g1: float
    c_2: float
    delta_1: float
    delta_2: float
    k_ts: float
    filtered: bool
    num: float
    a1: float
    a0: float
    at_load: bool
    sense: int
    low: float
    high: float
    loss_1: float
    loss_2: float
    N_3: float
    k_3: float
    c_3: float
    J_g2: float
    delta_3: float
    loss_3: float


class Bench(NamedTuple):
    """The clock. `rate_hz` 0: none. `kind`: 0 tachometer, 1 speed and 2 position of an encoder."""

    rate_hz: float
    holds: bool
    samples: bool
    kind: int
    counts: float
    held: bool
    delay_s: float


class Loop(NamedTuple):
    """A controller. `K_p` 0: none. `K_i` is K_p / T_i, `K_v` 0: of the speed alone."""

    K_p: float
    K_i: float
    K_v: float
    reference: bool
    filtered: bool
    digital: bool
    computing_s: float


def loop_of(document: dict[str, Any]) -> Loop:
    """The controller of a parsed unit file."""
    loop, clock = document.get("loop", {}), document.get("sampling")
    K_p = loop.get("K_p", 0.0)
    return Loop(
        K_p,
        K_p / loop["T_i_s"] if "T_i_s" in loop else 0.0,
        loop.get("K_v", 0.0),
        loop.get("excited", "reference") == "reference",
        bool(loop.get("filtered", False)),
        bool(clock and clock.get("holds_command", True)),
        loop.get("computing_s", 0.0),
    )


def plant_of(document: dict[str, Any], ratio: float, **changed: float) -> tuple[Plant, Bench]:
    """Plant and bench of a parsed unit file at a contribution ratio; some numbers changed."""
    d = document
    m, e, s1, load = d["motor"], d["electronics"], d["stage1"], d["load"]
    s2, s3, amp = d.get("stage2"), d.get("stage3", {}), d.get("amplifier")
    mc, lc = d.get("motor_coupling", {}), d.get("load_coupling", {})
    clock, sensor = d.get("sampling", {}), d.get("sensor", {"kind": "tachometer"})
    N, N_3 = s2["N"] if s2 else 1.0, s3.get("N_3", 1.0)
    b_t, b3 = d["backlash"]["b_t_deg"], s3.get("b3_deg", 0.0)
    b1, b2 = (ratio * (b_t - b3) * N * N_3, (1.0 - ratio) * (b_t - b3) * N_3) if s2 else (b_t, 0.0)
    den = e.get("filter_denominator", [1.0, 1.0, 1.0])
    numbers = {
        "current": amp is not None,
        "L_a": 1.0 / (2.0 * math.pi * amp["bandwidth_hz"]) if amp else m["L_a"],
        "R_m": 1.0 if amp else m["R_m"],
        "k_b": 0.0 if amp else m["k_b"],
        "k_t": m["k_t"],
        "k_a": e["k_a"],
        "i_max": amp.get("current_limit_a", math.inf) if amp else math.inf,
        "J_m": m["J_m"],
        "B_m": m["B_m"],
        "T_f_m": m["T_f_m"],
        "k_cm": mc.get("k_cm", 0.0),
        "c_cm": mc.get("c_cm", 0.0),
        "J_cm": mc.get("J_cm", 1.0),
        **{k: s1[k] for k in ("N_1", "k_g1", "J_g1", "k_s1", "J_s1")},
        "two": s2 is not None,
        "J_p2": s1.get("J_p2", 1.0),
        "N": N,
        "k_2": s2["k_2"] if s2 else 1.0,
        "k_cL": lc.get("k_cL", 0.0),
        "c_cL": lc.get("c_cL", 0.0),
        "J_cL": lc.get("J_cL", 1.0),
        "J_L": load["J_L"],
        "T_f_L": load["T_f_L"],
        **{k: d.get("damping", {}).get(k, 0.0) for k in ("B_L", "c_s1", "c_g1", "c_2")},
        "delta_1": math.radians(b1) / 2.0,
        "delta_2": math.radians(b2) / 2.0,
        "k_ts": e["k_ts"] * sensor.get("radius_m", 1.0),
        "filtered": "filter_numerator" in e,
        "num": e.get("filter_numerator", 1.0) / den[0],
        "a1": den[1] / den[0],
        "a0": den[2] / den[0],
        "at_load": sensor.get("at") == "load",
        "sense": {"accelerometer": 1, "current": 2}.get(sensor["kind"], 0),
        "low": 2.0 * math.pi * sensor.get("low_pass_hz", 0.0),
        "loss_1": 1.0 / s1.get("eta_1", 1.0) - 1.0,
        "loss_2": 1.0 / s2.get("eta_2", 1.0) - 1.0 if s2 else 0.0,
        "N_3": N_3,
        "k_3": s3.get("k_3", 0.0),
        "c_3": d.get("damping", {}).get("c_3", 0.0),
        "J_g2": s3.get("J_g2", 1.0),
        "delta_3": math.radians(b3) / 2.0,
        "loss_3": 1.0 / s3.get("eta_3", 1.0) - 1.0,
        "high": 2.0 * math.pi * sensor.get("high_pass_hz", 0.0),
    }
    numbers.update(changed)
    encoder = sensor["kind"] == "encoder"
    kind = (2 if sensor.get("reads") == "position" else 1) if encoder else 0
    bench = Bench(
        float(clock.get("rate_hz", 0.0)),
        bool(clock and clock.get("holds_command", True)),
        encoder or bool(sensor.get("sampled")),
        kind,
        float(sensor.get("counts", 0.0)),
        bool(sensor.get("held", False)),
        float(sensor.get("delay_s", 0.0)),
    )
    return Plant(**numbers), bench


_N = 22
# i, th_m, w_m, th_c, w_c, g1, wg1, s1, ws1, p2, wp2, h, wh, L, wL, V_o, dV_o, integral of
# the error, low-pass, high-pass, g2, wg2


@njit(cache=True)
def _dead(k, c, x, rate, d):
    if x > d:
        return k * (x - d) + c * rate
    if x < -d:
        return k * (x + d) + c * rate
    return 0.0


@njit(cache=True)
def _sgn(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@njit(cache=True)
def _slopes(m, u, fed, y, dy):
    """`u`: at the amplifier's input; `fed`: what the filter is fed with by an encoder."""
    command = m.k_a * u
    if m.current:
        command = min(max(command, -m.i_max), m.i_max)
    dy[0] = (command - m.R_m * y[0] - m.k_b * y[2]) / m.L_a
    # The motor, and pinion 1 on it or behind a coupling.
    pin, wpin = (y[3], y[4]) if m.k_cm > 0.0 else (y[1], y[2])
    T1 = _dead(m.k_g1, m.c_g1, pin / m.N_1 - y[5], wpin / m.N_1 - y[6], m.delta_1)
    L1 = T1 / m.N_1 + m.loss_1 * abs(T1) / m.N_1 * _sgn(wpin)
    drive = m.k_t * y[0] - m.B_m * y[2] - m.T_f_m * _sgn(y[2])
    dy[1], dy[3], dy[4] = y[2], 0.0, 0.0
    if m.k_cm > 0.0:
        Tc = m.k_cm * (y[1] - y[3]) + m.c_cm * (y[2] - wpin)
        dy[2] = (drive - Tc) / m.J_m
        dy[3], dy[4] = y[4], (Tc - L1) / m.J_cm
    else:
        dy[2] = (drive - L1) / m.J_m
    # Gear 1 and the first half of the shaft.
    Ta = 2.0 * (m.k_s1 * (y[5] - y[7]) + m.c_s1 * (y[6] - y[8]))
    dy[5], dy[6] = y[6], (T1 - Ta) / m.J_g1
    last, wlast = (y[11], y[12]) if m.k_cL > 0.0 else (y[13], y[14])
    dy[20], dy[21] = 0.0, 0.0
    if m.two:
        Tb = 2.0 * (m.k_s1 * (y[7] - y[9]) + m.c_s1 * (y[8] - y[10]))
        g2, wg2 = (y[20], y[21]) if m.k_3 > 0.0 else (last, wlast)
        T2 = _dead(m.k_2, m.c_2, y[9] / m.N - g2, y[10] / m.N - wg2, m.delta_2)
        dy[9], dy[10] = y[10], (Tb - T2 / m.N - m.loss_2 * abs(T2) / m.N * _sgn(y[10])) / m.J_p2
        arrives = T2
        if m.k_3 > 0.0:
            T3 = _dead(m.k_3, m.c_3, g2 / m.N_3 - last, wg2 / m.N_3 - wlast, m.delta_3)
            lost = m.loss_3 * abs(T3) / m.N_3 * _sgn(wg2)
            dy[20], dy[21] = wg2, (T2 - T3 / m.N_3 - lost) / m.J_g2
            arrives = T3
    else:
        Tb = 2.0 * (m.k_s1 * (y[7] - last) + m.c_s1 * (y[8] - wlast))
        dy[9], dy[10] = 0.0, 0.0
        arrives = Tb
    dy[7], dy[8] = y[8], (Ta - Tb) / m.J_s1
    # The load, or the hub before its coupling.
    dy[11], dy[12] = 0.0, 0.0
    if m.k_cL > 0.0:
        Th = m.k_cL * (y[11] - y[13]) + m.c_cL * (wlast - y[14])
        dy[11], dy[12] = y[12], (arrives - Th) / m.J_cL
        arrives = Th
    dy[13] = y[14]
    dy[14] = (arrives - m.T_f_L * _sgn(y[14]) - m.B_L * y[14]) / m.J_L
    dy[17], dy[18], dy[19] = 0.0, 0.0, 0.0
    if m.sense > 0:
        fed = m.k_ts * (y[0] if m.sense == 2 else (dy[14] if m.at_load else dy[2]))
        if m.low > 0.0:
            dy[18] = m.low * (fed - y[18])
            fed = y[18]
        if m.high > 0.0:
            dy[19] = m.high * (fed - y[19])
            fed -= y[19]
    dy[15], dy[16] = y[16], m.num * fed - m.a1 * y[16] - m.a0 * y[15]


@njit(cache=True)
def _shown(m, y):
    """What an analogue sensor and its filter, if any, give."""
    if m.filtered:
        return y[15]
    if m.sense == 0:
        return m.k_ts * (y[14] if m.at_load else y[2])
    return (y[18] if m.low > 0.0 else m.k_ts * y[0]) - y[19]


@njit(cache=True)
def _fed(m, bench, y, held):
    """What the filter is fed with: what the encoder last said, or the tachometer now."""
    return held if bench.kind > 0 else m.k_ts * (y[14] if m.at_load else y[2])


@njit(cache=True)
def _error(m, loop, source, y):
    """Error of an analogue speed controller, V."""
    speed = y[15] if loop.filtered else m.k_ts * (y[14] if m.at_load else y[2])
    return (source if loop.reference else 0.0) - speed


@njit(cache=True)
def _driven(m, loop, source, fed, y, dy):
    """Slopes with an analogue controller, or with none."""
    if loop.K_p == 0.0 or loop.digital:
        _slopes(m, source, fed, y, dy)
        return
    e = _error(m, loop, source, y)
    command = loop.K_p * e + loop.K_i * y[17]
    _slopes(m, command + (0.0 if loop.reference else source), fed, y, dy)
    dy[17] = e


@njit(cache=True)
def _dwell(m, bench, loop, volts, hertz, settle, cycles, dt, clock, counter, y, kept):
    """Sine and cosine in what is read in each kept cycle, as a complex number.

    `clock`: time to the next tick, command and reading that are held; then of a controller at the
    clock the sum of errors, the command to come, and the time until it comes. `counter`: the last
    count.
    """
    k = np.empty((4, _N))
    at = np.empty(_N)
    period = 1.0 / bench.rate_hz if bench.rate_hz > 0.0 else 0.0
    steps = int(round((settle + cycles) / (hertz * dt)))
    normal, right = np.zeros((cycles, 3, 3)), np.zeros((cycles, 3))
    for n in range(steps):
        t = n * dt
        if loop.K_p > 0.0 and loop.digital and clock[5] <= 0.5 * dt:
            # A command that takes a whole period comes when the next one is begun.
            clock[6] = clock[4]
        if bench.rate_hz > 0.0 and clock[0] <= 0.5 * dt:
            clock[0] += period
            clock[1] = volts * math.sin(2.0 * math.pi * hertz * t)
            angle, before = y[13] if m.at_load else y[1], counter[0]
            if bench.kind == 0:
                clock[2] = _shown(m, y)
            else:
                count = math.floor(angle * bench.counts / (2.0 * math.pi) + counter[1])
                size = 2.0 * math.pi / bench.counts
                if bench.kind == 1:
                    clock[2] = m.k_ts * (count - counter[0]) * size * bench.rate_hz
                else:
                    clock[2] = m.k_ts * count * size
                counter[0] = count
            if bench.samples and not bench.held and not (m.filtered and bench.kind > 0):
                _add(normal, right, t + bench.delay_s, clock[2], hertz, settle, cycles)
            if loop.K_p > 0.0 and loop.digital:
                if bench.kind > 0:
                    size = 2.0 * math.pi / bench.counts
                    speed = m.k_ts * (counter[0] - before) * size * bench.rate_hz
                else:
                    speed = -_error(m, loop, 0.0, y)
                set_point = clock[1] if loop.reference else 0.0
                if loop.K_v > 0.0:
                    set_point = loop.K_v * (set_point - m.k_ts * counter[0] * size)
                e = set_point - speed
                clock[4] = loop.K_p * e + loop.K_i * period * clock[3]
                clock[3] += e
                clock[5] = loop.computing_s
        if loop.K_p > 0.0 and loop.digital and clock[5] <= 0.5 * dt:
            # What is added behind the controller is added at its tick.
            clock[6] = clock[4]
        clock[5] -= dt
        fed = clock[2]
        if not bench.samples or bench.held or (m.filtered and bench.kind > 0):
            direct = clock[2] if bench.samples else _shown(m, y)
            value = y[15] if m.filtered and not (bench.samples and bench.kind == 0) else direct
            _add(normal, right, t + bench.delay_s, value, hertz, settle, cycles)
        held = bench.holds
        level = clock[1]
        if loop.K_p > 0.0 and loop.digital:
            level = clock[6] + (0.0 if loop.reference else clock[1])
        a = level if held else volts * math.sin(2.0 * math.pi * hertz * t)
        b = level if held else volts * math.sin(2.0 * math.pi * hertz * (t + 0.5 * dt))
        c = level if held else volts * math.sin(2.0 * math.pi * hertz * (t + dt))
        _driven(m, loop, a, _fed(m, bench, y, fed), y, k[0])
        for j in range(_N):
            at[j] = y[j] + 0.5 * dt * k[0, j]
        _driven(m, loop, b, _fed(m, bench, at, fed), at, k[1])
        for j in range(_N):
            at[j] = y[j] + 0.5 * dt * k[1, j]
        _driven(m, loop, b, _fed(m, bench, at, fed), at, k[2])
        for j in range(_N):
            at[j] = y[j] + dt * k[2, j]
        _driven(m, loop, c, _fed(m, bench, at, fed), at, k[3])
        for j in range(_N):
            y[j] += dt / 6.0 * (k[0, j] + 2.0 * (k[1, j] + k[2, j]) + k[3, j])
        clock[0] -= dt
    for cycle in range(cycles):
        found = np.linalg.solve(normal[cycle], right[cycle])
        kept[cycle] = found[1] + 1j * found[2]


@njit(cache=True)
def _add(normal, right, t, value, hertz, settle, cycles):
    """One more equation for mean, sine and cosine of a cycle, by least squares."""
    cycle = int(math.floor(t * hertz)) - settle
    if 0 <= cycle < cycles:
        turn = 2.0 * math.pi * hertz * t
        row = (1.0, math.sin(turn), math.cos(turn))
        for i in range(3):
            for j in range(3):
                normal[cycle, i, j] += row[i] * row[j]
            right[cycle, i] += row[i] * value


def sweep(
    document: dict[str, Any],
    ratio: float,
    frequencies_hz: Any,
    volts: float,
    settle: int = 20,
    cycles: int = 30,
    step_s: float = 2e-6,
    seed: int = 0,
    **changed: float,
) -> np.ndarray:
    """V_o/V_i of each kept cycle (points, cycles), the state carried on from point to point.

    Samples that are recorded are fitted as they are, at the times of their ticks. What an encoder
    says is held where a filter follows it. The last cycle of a delayed reading lacks what arrives
    after its end.
    """
    m, bench = plant_of(document, ratio, **changed)
    loop = loop_of(document)
    assert loop.computing_s * bench.rate_hz < 1.0 + 1e-9
    rng = np.random.default_rng(seed)
    period = 1.0 / bench.rate_hz if bench.rate_hz else 0.0
    clock = np.array([rng.random() * period, *[0.0] * 6])
    counter = np.array([0.0, rng.random()])
    y = np.zeros(_N)
    found = np.zeros((len(frequencies_hz), cycles), dtype=complex)
    for i, hertz in enumerate(frequencies_hz):
        _dwell(
            m, bench, loop, volts, float(hertz), settle, cycles, step_s, clock, counter, y, found[i]
        )
    return found / volts


@njit(cache=True)
def _by_signal(m, volts, dt, every, y, kept):
    """What is read after each `every` steps; `volts` at every half step, one more at the end."""
    k = np.empty((4, _N))
    at = np.empty(_N)
    for n in range(kept.size * every):
        a, b, c = volts[2 * n], volts[2 * n + 1], volts[2 * n + 2]
        _slopes(m, a, m.k_ts * (y[14] if m.at_load else y[2]), y, k[0])
        for stage, (share, u) in enumerate(((0.5, b), (0.5, b), (1.0, c))):
            for j in range(_N):
                at[j] = y[j] + share * dt * k[stage, j]
            _slopes(m, u, m.k_ts * (at[14] if m.at_load else at[2]), at, k[stage + 1])
        for j in range(_N):
            y[j] += dt / 6.0 * (k[0, j] + 2.0 * (k[1, j] + k[2, j]) + k[3, j])
        if n % every == every - 1:
            kept[n // every] = _shown(m, y)


def by_signal(
    document: dict[str, Any],
    ratio: float,
    volts: np.ndarray,
    step_s: float,
    every: int,
    **changed: float,
) -> np.ndarray:
    """What is read after every so many steps, from rest, of a drive without a clock.

    `volts`: the input at every half step from t = 0 to the end, one more than twice the steps.
    """
    m, bench = plant_of(document, ratio, **changed)
    assert bench.rate_hz == 0.0
    kept = np.zeros((len(volts) - 1) // (2 * every))
    _by_signal(m, volts, step_s, every, np.zeros(_N), kept)
    return kept
