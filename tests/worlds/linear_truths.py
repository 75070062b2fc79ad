"""Linear responses whose truth is written down as zeros and poles."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from daq.frf import DB_PER_NEPER, FrequencyResponse


def pair(f, f_0, zeta):
    return 1 - (f / f_0) ** 2 + 2j * zeta * f / f_0


@dataclass(frozen=True)
class Truth:
    """A zero pair over a pole pair, and what surrounds them; all frequencies in Hz."""

    zero: float = 40.0
    zeta_zero: float = 0.05
    pole: float = 70.0
    zeta_pole: float = 0.05
    integrator: bool = True
    corner: float = math.inf
    delay_s: float = 0.0
    start: float = 20.0
    stop: float = 110.0
    step: float = 0.5

    @property
    def f(self):
        return np.arange(self.start, self.stop + 1e-9, self.step)

    def response(self, f, zero=None, zeta_zero=None, pole=None, zeta_pole=None):
        h = pair(f, zero or self.zero, zeta_zero or self.zeta_zero)
        h = h / pair(f, pole or self.pole, zeta_pole or self.zeta_pole)
        if self.integrator:
            h = h * 30.0 / (1j * f)
        if math.isfinite(self.corner):
            h = h / pair(f, self.corner, 1.0)
        return h * np.exp(-2j * np.pi * f * self.delay_s)

    def extrema(self, **changed):
        """Exact ARF and RF."""

        def level(f, sign):
            return sign * np.log(np.abs(self.response(np.array([f]), **changed)[0]))

        middle = math.sqrt(self.zero * self.pole)
        options = {"xatol": 1e-9}
        arf = minimize_scalar(
            level, bounds=(0.7 * self.zero, middle), args=(1,), method="bounded", options=options
        )
        rf = minimize_scalar(
            level, bounds=(middle, 1.3 * self.pole), args=(-1,), method="bounded", options=options
        )
        return np.array([arf.x, rf.x])

    def measured(self, seed, noise, *, stated=True, phase=True):
        """One sweep; `noise` is the standard deviation of each relative component."""
        rng = np.random.default_rng(seed)
        f = self.f
        h = self.response(f) * (
            1 + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
        )
        return FrequencyResponse.from_arrays(
            f,
            2.5,
            h if phase else np.abs(h),
            unit="truth",
            phase_known=phase,
            gain_std_db=noise * DB_PER_NEPER if stated else None,
        )


TWO_PERCENT = 0.02 / math.sqrt(2)
"""2 % root mean square of the complex noise: this much along the gain, and across it."""

NOTED = Truth(zeta_zero=0.03)
"""ARF 39.966 Hz and RF 70.168 Hz."""
