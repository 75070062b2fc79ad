"""General solvers on the servo: SciPy, python-control, diffrax, GNU Octave.

Each function takes the matrices, a state to start from and a drive, and gives V_o/V_i of every
cycle with the processor time it took, s. Imports and compilation are not counted.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from yardsticks.matrices import OUTPUT, SAMPLES, Matrices, gains

from sim.engine.compiling import njit

Drive = tuple[float, int, float]
"""Frequency in Hz, cycles, source level in V peak."""

OCTAVE = """
load("-text", "given.txt");
V = @(t) source_vpk * sin(2 * pi * frequency_hz * t);
rate = @(t, x) A * x + b * V(t) + G * [stiffness .* max(min(C(1:2,:) * x, play), -play); ...
                                       torque .* tanh((C(3:4,:) * x) ./ width)];
began = cputime();
if strcmp(solver, "lsode")
  lsode_options("relative tolerance", rtol);
  lsode_options("absolute tolerance", 1e-9);
  lsode_options("step limit", 1000000);
  x = lsode(@(x, t) rate(t, x), start, times);
else
  options = odeset("RelTol", rtol, "AbsTol", 1e-9);
  [t, x] = ode45(rate, times, start, options);
end
spent = cputime() - began;
printf("%.17g\\n", spent);
printf("%.17g\\n", x(:, output));
"""


def _times(drive: Drive) -> np.ndarray:
    frequency, cycles, _ = drive
    return np.arange(cycles * SAMPLES + 1) / (SAMPLES * frequency)


@njit(cache=True)
def _compiled(t, x, A, b, G, C, stiffness, play, torque, width, omega, level):
    y = C @ x
    force = np.empty(4)
    for j in range(2):
        force[j] = stiffness[j] * min(max(y[j], -play[j]), play[j])
        force[2 + j] = torque[j] * np.tanh(y[2 + j] / width[j])
    return A @ x + b * (level * np.sin(omega * t)) + G @ force


def _arguments(given: Matrices, drive: Drive) -> tuple:
    frequency, _, level = drive
    return (
        given.A, given.b, given.G, given.C, given.stiffness, given.play, given.torque, given.width,
        2.0 * np.pi * frequency, level,
    )  # fmt: skip


def scipy_lsoda(given: Matrices, start: np.ndarray, drive: Drive, rtol: float):
    """`scipy.integrate.solve_ivp` by LSODA, its right-hand side compiled."""
    from scipy.integrate import solve_ivp

    times, arguments = _times(drive), _arguments(given, drive)
    _compiled(0.0, start, *arguments)
    began = time.process_time()
    done = solve_ivp(
        _compiled, (0.0, times[-1]), start, "LSODA", times[:-1], args=arguments, rtol=rtol,
        atol=_absolute(rtol),
    )  # fmt: skip
    return gains(done.y[OUTPUT], drive[2]), time.process_time() - began


def control_response(given: Matrices, start: np.ndarray, drive: Drive, rtol: float):
    """`control.input_output_response` of a nonlinear system, by LSODA."""
    import control

    frequency, _, level = drive
    times = _times(drive)
    system = control.NonlinearIOSystem(
        lambda t, x, u, _: given.rate(u[0], x), lambda t, x, u, _: x[OUTPUT],
        inputs=1, outputs=1, states=len(start),
    )  # fmt: skip
    began = time.process_time()
    done = control.input_output_response(
        system, times, level * np.sin(2.0 * np.pi * frequency * times), start,
        solve_ivp_method="LSODA", solve_ivp_kwargs={"rtol": rtol, "atol": _absolute(rtol)},
    )  # fmt: skip
    return gains(done.outputs[:-1], level), time.process_time() - began


def diffrax_lanes(given: Matrices, start: np.ndarray, drive: Drive, rtol: float, lanes: int = 1):
    """`diffrax.diffeqsolve` by Tsit5, vmapped over lanes; the time is that of one lane."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    frequency, _, level = drive
    times = jnp.asarray(_times(drive)[:-1])
    term = diffrax.ODETerm(
        lambda t, x, _: given.rate(level * jnp.sin(2.0 * jnp.pi * frequency * t), x, jnp)
    )

    def one(x):
        done = diffrax.diffeqsolve(
            term, diffrax.Tsit5(), 0.0, _times(drive)[-1], 1e-6, x,
            saveat=diffrax.SaveAt(ts=times, fn=lambda t, y, _: y[OUTPUT]), max_steps=10_000_000,
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=_absolute(rtol)),
        )  # fmt: skip
        return done.ys

    # Starts that differ by less than matters: lanes in lockstep take the steps of the worst.
    near = start + 1e-12 * np.arange(lanes)[:, None]
    solve = jax.jit(jax.vmap(one)).lower(near).compile()
    began = time.process_time()
    samples = np.asarray(solve(near))
    return gains(samples[0], level), (time.process_time() - began) / lanes


def octave(given: Matrices, start: np.ndarray, drive: Drive, rtol: float, solver: str):
    """GNU Octave's own `lsode` or `ode45`, the right-hand side as matrices."""
    frequency, _, level = drive
    values = {name: getattr(given, name) for name in Matrices.__slots__}
    values |= {"start": start, "times": _times(drive), "frequency_hz": frequency, "rtol": rtol,
               "source_vpk": level, "output": OUTPUT + 1}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        lines = [
            f"# name: solver\n# type: string\n# elements: 1\n# length: {len(solver)}\n{solver}"
        ]
        for name, value in values.items():
            table = np.atleast_2d(np.asarray(value, dtype=float))
            table = table.T if np.ndim(value) == 1 else table
            rows = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in table)
            size = f"# rows: {table.shape[0]}\n# columns: {table.shape[1]}"
            lines.append(f"# name: {name}\n# type: matrix\n{size}\n{rows}")
        (Path(folder) / "given.txt").write_text("\n".join(lines) + "\n")
        run = subprocess.run(
            ["octave-cli", "--quiet", "--no-init-file", "--eval", OCTAVE],
            cwd=folder, check=True, capture_output=True, text=True,
        )  # fmt: skip
    spent, *samples = (float(line) for line in run.stdout.split())
    return gains(np.array(samples[:-1]), level), spent


def octave_is_here() -> bool:
    """Whether GNU Octave is on the machine."""
    return shutil.which("octave-cli") is not None


def _absolute(rtol: float) -> float:
    """Absolute tolerance: plays are 1e-4 rad and must be met to 1e-3 of themselves."""
    return min(rtol * 1e-3, 1e-7)
