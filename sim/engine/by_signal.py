"""Lanes of one system driven by any signal of known lines: what it reads, sample by sample.

Owns the program that steps such lanes and the tables of the closed system's steady response, which
takes the place of the sine's. The step itself is that of `sim.engine.kernel`. It knows no
estimator and no level.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numpy.typing import NDArray

from daq.errors import AnalysisError
from sim.engine.engine import Moving, program_of, times
from sim.engine.kernel import FIRST_SWEEPS, MOST_VECTORS, Program, program_by
from sim.engine.lanes import VECTOR_BYTES, Lanes
from sim.engine.layout import STEPS_SEEN, Layout
from sim.engine.nonlinearity import Reading, held
from sim.engine.propagator import build_propagator, find_modes
from sim.engine.solving import law_parameters
from sim.engine.system import PiecewiseLinearSystem

__all__ = ["SignalDrive", "shortest_step_s"]

_MOST_STEPS = 1 << 23
"""Of a period: its tables take 30 MB for each law and precision of four bytes."""

_FEWEST_STEPS = 64
"""In a cycle of the fastest line."""

_INT = ir.IntType(64)


def shortest_step_s(period_s: float, lines: NDArray[np.int64]) -> float:
    """The step that the fastest line of a signal asks for, s."""
    return period_s / (_FEWEST_STEPS * float(lines[-1]))


class SignalDrive:
    """A system driven by one period of a signal, at one time step.

    Parameters
    ----------
    system
        Shared by all lanes.
    period_s
        Of the signal, s.
    lines
        (lines,) multiples of 1 / period.
    phasors
        (lines,) of the input u(t) = Im(sum_k phasor_k exp(2 pi i f_k t)), V.
    longest_step_s
        Upper bound of the time step, s.
    single
        Single precision.

    Raises
    ------
    AnalysisError
        If a period is too long for its tables.
    """

    def __init__(
        self,
        system: PiecewiseLinearSystem,
        period_s: float,
        lines: NDArray[np.int64],
        phasors: NDArray[np.complex128],
        longest_step_s: float,
        single: bool,
    ) -> None:
        if period_s > _MOST_STEPS * longest_step_s:
            raise AnalysisError(
                f"a signal of {period_s:.4g} s is too long to simulate: up to "
                f"{_MOST_STEPS * longest_step_s:.4g} s can be; give a coarser resolution"
            )
        self._moving = Moving(system, find_modes(system), single)
        longest = min(longest_step_s, shortest_step_s(period_s, lines) * (1.0 + 1e-9))
        self._propagator = build_propagator(system, self._moving.modes, 1.0 / period_s, longest)
        self._lines, self._phasors = lines, phasors
        self._omega = 2j * np.pi * lines / period_s
        eye = np.eye(len(system.b))
        # (lines, n): the closed system's steady response.
        self._forced = np.concatenate([
            np.linalg.solve(some[:, None, None] * eye - system.A, system.b[:, None] + 0j)[..., 0]
            for some in np.array_split(self._omega, -(-len(lines) // 4096))
        ]) * phasors[:, None]  # fmt: skip

    @property
    def step_s(self) -> float:
        """The time step, s."""
        return self._propagator.step_s

    @property
    def samples(self) -> int:
        """Samples of the output in a period, one at the end of every fourth step."""
        return self._propagator.steps_per_cycle // STEPS_SEEN

    def recorded(self) -> NDArray[np.complex128]:
        """(lines,): what is between the output and the bench's records."""
        system = self._moving.system
        factor = np.ones(len(self._lines), dtype=complex)
        if system.reading != Reading():
            factor = system.reading.factor(self._omega)
        if self._moving.direct[-1].any():
            factor = factor / held(self._omega * STEPS_SEEN * self.step_s)
        return factor

    def run(
        self,
        parameters: NDArray[np.float64],
        state: NDArray[np.float64],
        amplitude: NDArray[np.float64],
        offset: NDArray[np.float64],
        parts: Sequence[int],
    ) -> Iterator[NDArray[np.floating]]:
        """Step through parts of the period, one after the other, and again from its start.

        Parameters
        ----------
        parameters
            (m, 3, lanes).
        state
            (n and 5 per sampled law, lanes) at the start.
        amplitude, offset
            (lanes,): factor on the signal, and constant input, V.
        parts
            Samples of each part; none goes across the end of a period.

        Yields
        ------
        ndarray
            (samples, lanes): the output at the end of every fourth step, V.

        Raises
        ------
        AnalysisError
            If a motion grew without bound.
        """
        moving, propagator = self._moving, self._propagator
        system = moving.system
        drift = propagator.drift[:, None] + propagator.offset_drift[:, None] * offset
        gain = moving.look @ propagator.push
        if moving.direct.any():
            gain = gain + moving.direct
        layout, coefficients = program_of(moving, propagator, gain, bool(drift.any()))
        inner, kept = state[: len(system.b)], state[len(system.b) :]
        start = self._forced.sum(axis=0).imag[:, None] * amplitude
        fed = float(self._phasors.sum().imag) * amplitude + offset
        waves = np.zeros((layout.m + 1, 3, len(amplitude)))
        waves[:, 0], waves[:, 2] = amplitude, moving.through * offset
        rows = {
            "q": times(moving.modes.weights, inner - start),
            "seen": times(moving.rows, inner) + moving.through * fed,
            "drift": drift,
            "waves": waves.reshape(-1, len(amplitude)),
            "parameters": law_parameters(moving.kinds, parameters, gain, propagator.step_s),
            "held": kept,
        }
        table = self._table(layout)
        blocks = [_Block(layout, coefficients, rows, of) for of in _calls(layout, len(amplitude))]
        at = 0
        for part in parts:
            there = table[at * STEPS_SEEN :]
            out = np.empty((part, len(amplitude)), dtype=layout.dtype)
            for block in blocks:
                out[:, block.lanes] = block.step(there, part)
            if not np.all(np.isfinite(out)):
                raise AnalysisError(
                    "the simulated motion grew without bound; check the parameters, or take a "
                    "shorter step"
                )
            yield out
            at = (at + part) % self.samples

    def _table(self, layout: Layout) -> NDArray[Any]:
        """(steps + 1, m + 1): what the signal alone makes each law and, last, the output see."""
        steps = self._propagator.steps_per_cycle
        seen = self._forced @ self._moving.rows.T + self._phasors[:, None] * self._moving.through.T
        table = layout.blank(steps + 1, layout.m + 1)
        spectrum = np.zeros(steps // 2 + 1, dtype=complex)
        for j, column in enumerate(seen.T):
            spectrum[self._lines] = -0.5j * steps * column
            table[:-1, j] = np.fft.irfft(spectrum, steps)
        table[-1] = table[0]
        return table


class _Block:
    """Up to four vectors of lanes, and how they stand."""

    def __init__(
        self,
        layout: Layout,
        coefficients: NDArray[np.float64],
        rows: dict[str, NDArray[np.float64]],
        of: NDArray[np.intp],
    ) -> None:
        self.lanes = of
        self._layout = layout
        self._block = layout.blank(layout.lanes["peak"].stop, of.size)
        for name, known in rows.items():
            at = layout.lanes[name]
            self._block[at.start : at.stop] = known[:, of]
        self._coefficients = np.ascontiguousarray(coefficients, dtype=layout.dtype)
        self._program = program_by(_BySignal, __file__, layout.structure, of.size // layout.width)
        self._sweeps = FIRST_SWEEPS

    def step(self, table: NDArray[Any], samples: int) -> NDArray[Any]:
        """Go on by so many samples, from the start of a table."""
        out = self._layout.blank(samples, self.lanes.size)
        self._program(
            self._coefficients.ctypes.data, self._block.ctypes.data, table.ctypes.data,
            samples * STEPS_SEEN, self._sweeps, 0, out.ctypes.data,
        )  # fmt: skip
        self._sweeps = 1
        return out


def _calls(layout: Layout, count: int) -> Iterator[NDArray[np.intp]]:
    """Lanes of each block; one that is not full repeats some, which end alike."""
    at, width = 0, layout.width
    while at < count:
        vectors = -(-(count - at) // width)
        taken = min(MOST_VECTORS, 1 << (vectors.bit_length() - 1)) * width
        yield np.resize(np.arange(at, min(at + taken, count)), taken)
        at += taken


class _BySignal(Program):
    """Writes the program of one structure, for lanes that a table of waves drives.

    The program's arguments are those of `Program`, but for the table, the sweeps in the first step
    in place of the settle cycles, and samples in place of sums.
    """

    def _run(self, settle: Any, kept: Any) -> None:
        emit, count = self._emit, len(self._all)
        emit.store(settle, self._sweeps)
        with self._times(emit.sdiv(self._steps, _INT(STEPS_SEEN))) as share:
            first = emit.mul(share, _INT(STEPS_SEEN))
            with self._times(_INT(STEPS_SEEN)) as step:
                self._step(self._wave_at(emit.add(first, step)))
            output = self._output(self._wave_at(emit.add(first, _INT(STEPS_SEEN - 1))))
            for v, vector in zip(self._all, output.vectors, strict=True):
                row = emit.add(emit.mul(share, _INT(count)), _INT(v))
                place = emit.mul(row, _INT(self._code.width))
                emit.store(vector, self._vector_at(self._sums, place), align=VECTOR_BYTES)
            self._look_anew()

    def _wave_at(self, step: Any) -> Any:
        """Where the row of the table at the end of a step begins."""
        return self._emit.mul(self._emit.add(step, _INT(1)), _INT(self._layout.m + 1))

    def _driven(self, j: int, at: Any, vectors: Sequence[int]) -> Lanes:
        """What the signal alone makes law j, or the output, see."""
        there = self._load("waves", 3 * j, vectors) * self._wave(at, j, vectors)
        constant = self._load("waves", 3 * j + 2, vectors) if self._steady else 0.0
        return there + constant
