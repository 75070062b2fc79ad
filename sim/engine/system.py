"""From a list of physical elements to matrices and switching laws.

Owns the form that the engine steps, a linear system with a few scalar,
memoryless, piecewise-linear feedbacks, and the bookkeeping that builds it. It
knows neither gears nor gimbals, and never touches time.

    x'  = A x + b u + f + sum_j g_j p_j          y_j = c_j x + d_j u
    V_o = o x + sum_j r_j p_j                    p_j = law_j(y_j)

A mesh with play enters as its closed stiffness in A and a bounded force p_j
that takes the play back out. With the play at zero nothing but the linear
system remains, and while a mesh is in contact p_j is constant: both cases are
then stepped exactly. A law that a clock samples has a memory besides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from daq.errors import ConfigurationError
from sim.engine.linear import sampled_response, smooth_response
from sim.engine.nonlinearity import SAMPLED, Law, Nonlinearity, Reading

__all__ = ["SAMPLED", "Assembly", "Law", "Nonlinearity", "PiecewiseLinearSystem", "Reading"]

Along = Mapping[str, float]
"""A direction over coordinates: the torque tau acts as tau * coefficient on each of them."""


_KnownLaw = tuple[str, Law, dict[str, float], Along, float, float, float, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class PiecewiseLinearSystem:
    """What the engine steps; shapes for n states.

    `A` (n, n), `b` (n,) input, `f` (n,) constant forcing, `o` (n,) output row,
    `states` the names, `energy` a symmetric (n, n) matrix such that
    x' energy x / 2 is the stored energy with every mesh closed. `closed`: whether what a clock
    samples may come back to it, through a controller.
    """

    A: NDArray[np.float64]
    b: NDArray[np.float64]
    f: NDArray[np.float64]
    o: NDArray[np.float64]
    nonlinearities: tuple[Nonlinearity, ...]
    states: tuple[str, ...]
    energy: NDArray[np.float64]
    reading: Reading = Reading()
    closed: bool = False

    @property
    def sampled(self) -> tuple[Nonlinearity, ...]:
        """The laws that a clock samples."""
        return tuple(law for law in self.nonlinearities if law.law in SAMPLED)

    def opened(self) -> PiecewiseLinearSystem:
        """The system with every mesh inside its play, so that the teeth never touch."""
        A = self.A
        for law in self.nonlinearities:
            if law.law is Law.PLAY:
                # The row of a coordinate in A is its rate.
                takes = law.stiffness * law.outlet + law.damping * (law.outlet @ self.A)
                A = A + np.outer(law.inlet, takes)
        return replace(self, A=A)

    def transfer(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Linear response V_o/u with every mesh closed and no friction, shape of the input."""
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=float)
        return sampled_response(self, s) if self.sampled else smooth_response(self, s)


@dataclass(slots=True)
class Assembly:
    """Collects elements by name and turns them into a `PiecewiseLinearSystem`.

    Coordinates are angles with an inertia; signals are first-order states
    (currents, voltages). Every torque is given along a direction over
    coordinates, so that one law serves springs between any of them.
    """

    inertias: dict[str, float] = field(default_factory=dict)
    signals: list[str] = field(default_factory=list)
    output: dict[str, float] = field(default_factory=lambda: {"V_o": 1.0})
    reading: Reading = Reading()
    closed: bool = False
    _torques: list[tuple[Along, Along, float, float]] = field(default_factory=list)
    _couplings: list[tuple[str, str, float]] = field(default_factory=list)
    _inputs: dict[str, float] = field(default_factory=dict)
    _constants: dict[str, float] = field(default_factory=dict)
    _laws: list[_KnownLaw] = field(default_factory=list)
    _reads: dict[str, float] = field(default_factory=dict)
    _hears: dict[str, tuple[tuple[int, float], ...]] = field(default_factory=dict)
    _loaded_by: dict[str, int] = field(default_factory=dict)

    def add_inertia(self, coordinate: str, J: float) -> None:
        """Add a coordinate with inertia J in kg.m^2."""
        if coordinate in self.inertias:
            raise ConfigurationError(f"coordinate {coordinate!r} is given twice; name it once")
        if not J > 0:
            raise ConfigurationError(f"inertia of {coordinate!r} is {J} kg.m^2; it must be above 0")
        self.inertias[coordinate] = J

    def add_signal(self, signal: str) -> None:
        """Add a first-order state that has no inertia."""
        self.signals.append(signal)

    def add_torque(self, along: Along, stiffness: float = 0.0, damping: float = 0.0) -> None:
        """A linear spring and damper along one direction."""
        self._torques.append((along, along, stiffness, damping))

    def add_coupling(self, target: str, source: str, coefficient: float) -> None:
        """Let `target`' (a signal's rate or a rate's torque) gain coefficient * `source`.

        `source` and a signal `target` are state names; a coordinate as `target`
        means a torque on it.
        """
        self._couplings.append((target, source, coefficient))

    def add_input(self, signal: str, coefficient: float) -> None:
        """Let the rate of a signal gain coefficient * u."""
        self._inputs[signal] = self._inputs.get(signal, 0.0) + coefficient

    def add_constant_torque(self, coordinate: str, torque: float) -> None:
        """A constant torque in N.m."""
        self._constants[coordinate] = self._constants.get(coordinate, 0.0) + torque

    def add_law(
        self,
        name: str,
        law: Law,
        acts_on: Along,
        looks_at: Along,
        *,
        feedthrough: float = 0.0,
        stiffness: float = 0.0,
        damping: float = 0.0,
        parameters: tuple[float, ...] = (),
        read: float = 0.0,
        hears: Along | None = None,
        loaded_by: str = "",
    ) -> None:
        """Add a scalar law from a combination of states to torques or signal rates.

        `looks_at` and `acts_on` are over state names; in `acts_on` a coordinate
        means a torque, a signal means its rate. For `Law.PLAY` the closed
        stiffness and damping are added along the same direction. `read`: what the
        output takes of it; `hears`: what it sees of laws that were added before; `loaded_by`:
        the play, added before, that loads a friction.
        """
        places = {known: i for i, (known, *_) in enumerate(self._laws)}
        self._reads[name] = read
        self._hears[name] = tuple((places[k], c) for k, c in (hears or {}).items())
        self._loaded_by[name] = places.get(loaded_by, -1)
        if law is Law.PLAY:
            self.add_torque(looks_at, stiffness, damping)
        self._laws.append(
            (name, law, dict(acts_on), looks_at, feedthrough, stiffness, damping, parameters)
        )

    def let_act(self, name: str, target: str, coefficient: float) -> None:
        """Let a law that was added before act on one more signal or coordinate."""
        acts_on = next(acts for known, _, acts, *_ in self._laws if known == name)
        acts_on[target] = acts_on.get(target, 0.0) + coefficient

    def build(self, output: Along | None = None) -> PiecewiseLinearSystem:
        """Matrices and laws, with `output` as the row of what is read, V_o where not given."""
        at = _States(self.signals, self.inertias)
        n = len(at.names)
        A, energy = np.zeros((n, n)), np.zeros((n, n))
        b, f = np.zeros(n), np.zeros(n)
        for q, J in self.inertias.items():
            A[at.index[q], at.index[f"{q}'"]] = 1.0
            energy[at.index[f"{q}'"], at.index[f"{q}'"]] = J
        for acts, looks, stiffness, damping in self._torques:
            A -= np.outer(
                at.forcing(acts), stiffness * at.row(looks) + damping * at.row(looks, "'")
            )
            energy += stiffness * np.outer(at.row(looks), at.row(looks))
        for target, source, coefficient in self._couplings:
            A += np.outer(at.forcing({target: coefficient}), at.row({source: 1.0}))
        for signal, coefficient in self._inputs.items():
            b += at.forcing({signal: coefficient})
        for coordinate, torque in self._constants.items():
            f += at.forcing({coordinate: torque})

        nonlinearities = tuple(
            Nonlinearity(
                name=name,
                law=law,
                inlet=at.forcing(acts),
                outlet=at.row(looks),
                feedthrough=feedthrough,
                stiffness=stiffness,
                damping=damping,
                parameters=(*parameters, 0.0, 0.0, 0.0)[:3],  # type: ignore[arg-type]
                read=self._reads[name],
                smooth=at.row(looks, "'" if law is Law.COUNT_RATE else "")
                if law in SAMPLED
                else None,
                hears=self._hears[name],
                loaded_by=self._loaded_by[name],
            )
            for name, law, acts, looks, feedthrough, stiffness, damping, parameters in self._laws
        )
        return PiecewiseLinearSystem(
            A=A,
            b=b,
            f=f,
            o=at.row(self.output if output is None else output),
            nonlinearities=nonlinearities,
            states=at.names,
            energy=energy,
            reading=self.reading,
            closed=self.closed,
        )


class _States:
    """State names in order, and directions over coordinates as rows and columns over them."""

    def __init__(self, signals: Iterable[str], inertias: Mapping[str, float]) -> None:
        self._inertias = inertias
        self.names = (*signals, *inertias, *(f"{q}'" for q in inertias))
        self.index = {name: i for i, name in enumerate(self.names)}

    def row(self, along: Along, prime: str = "") -> NDArray[np.float64]:
        """Coefficients over states; with a prime those of the rates."""
        vector = np.zeros(len(self.names))
        for name, coefficient in along.items():
            vector[self.index[name + prime]] += coefficient
        return vector

    def forcing(self, along: Along) -> NDArray[np.float64]:
        """What a torque along coordinates, or a rate of signals, adds to the rates of states."""
        vector = np.zeros(len(self.names))
        for name, coefficient in along.items():
            if name in self._inertias:
                vector[self.index[f"{name}'"]] += coefficient / self._inertias[name]
            else:
                vector[self.index[name]] += coefficient
        return vector
