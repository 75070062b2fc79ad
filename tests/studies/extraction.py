"""How well ARF, RF and damping of known linear responses are read: 46 kinds of case, many draws.

Owns the cases, their exact features, and the score of a reader on them: how often each feature is
found, and how often its 95 % interval holds the truth. Draws depend on case and number alone, so
two revisions are compared on the same ones. It runs on any revision that has `extract`.

    python tests/studies/extraction.py run READINGS.json [DRAWS]
    python tests/studies/extraction.py table READINGS.json [READINGS_OF_ANOTHER_REVISION.json]
"""

from __future__ import annotations

import json
import math
import sys
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from analysis.resonance import extract, to_json  # noqa: E402
from daq.frf import DB_PER_NEPER, FrequencyResponse  # noqa: E402

__all__ = ["CASES", "Case", "measured", "truth"]

Vector = NDArray[np.float64]
NEAR = 0.15
"""A reported feature is that of the truth which is nearest, within this in ln f."""


@dataclass(frozen=True)
class Case:
    """A linear response and how it is measured; frequencies in Hz.

    Parameters
    ----------
    zeros, poles
        Frequency and damping ratio of the pairs; a negative damping ratio of zeros is one in the
        right half plane.
    noise
        Standard deviation of each component, as a share of the gain or, where `absolute`, of the
        greatest gain.
    stated
        Stated errors over the true ones; None where none are stated.
    spike
        Factor on one reading, three quarters along the sweep.
    """

    name: str
    zeros: tuple[tuple[float, float], ...] = ((40.0, 0.03),)
    poles: tuple[tuple[float, float], ...] = ((70.0, 0.05),)
    integrator: bool = True
    corner: tuple[float, float] | None = None
    lag: float | None = None
    delay_s: float = 0.0
    start: float = 20.0
    stop: float = 110.0
    points: int = 181
    log: bool = False
    jitter: float = 0.0
    noise: float = 0.014
    absolute: bool = False
    stated: float | None = 1.0
    phase: bool = True
    spike: float = 1.0


_CORNERS = (
    Case("low-pass at twice RF, zeta 0.7", corner=(140.0, 0.7)),
    Case("low-pass at 1.3 RF, zeta 0.7", corner=(90.0, 0.7)),
    Case("low-pass at 1.1 RF, zeta 1", corner=(77.0, 1.0)),
    Case("low-pass at RF, zeta 0.7", corner=(70.0, 0.7)),
    Case("low-pass and delay of 1 ms", corner=(135.0, 1.0), delay_s=1e-3),
    Case("first-order lag at 50 Hz", lag=50.0),
    Case("delay of 5 ms", delay_s=5e-3),
)
_NOISES = (
    Case("zeta 0.03 / 0.05, noise 2 %"),
    Case("noise 0.1 %", noise=7e-4),
    Case("noise 0.5 %", noise=0.0035),
    Case("noise 5 %", noise=0.035),
    Case("noise 10 %", noise=0.07),
    Case("constant noise", noise=1e-3, absolute=True),
    Case("constant noise above the valley's depth", noise=3e-3, absolute=True),
    Case("no errors stated", stated=None),
    Case("no errors stated, constant noise", stated=None, noise=1e-3, absolute=True),
    Case("errors stated at half", stated=0.5),
    Case("errors stated at a sixth", stated=1 / 6),
    Case("errors stated at twice", stated=2.0),
    Case("gain alone", phase=False),
    Case("gain alone, low-pass at 1.3 RF", phase=False, corner=(90.0, 0.7)),
)
_DAMPINGS = (
    Case("zeta 0.002 / 0.002", zeros=((40.0, 0.002),), poles=((70.0, 0.002),)),
    Case("zeta 0.01 / 0.02", zeros=((40.0, 0.01),), poles=((70.0, 0.02),)),
    Case("zeta 0.1 / 0.1", zeros=((40.0, 0.1),), poles=((70.0, 0.1),)),
    Case("zeta 0.3 / 0.3", zeros=((40.0, 0.3),), poles=((70.0, 0.3),), integrator=False),
    Case("zeta 0.3 / 0.05", zeros=((40.0, 0.3),), poles=((70.0, 0.05),)),
    Case("zeta 0.05 / 0.3", zeros=((40.0, 0.05),), poles=((70.0, 0.3),), integrator=False),
    Case("zeros in the right half plane", zeros=((40.0, -0.03),)),
)
_GRIDS = (
    Case("61 points", points=61),
    Case("61 points, zeta 0.01 / 0.02", points=61, zeros=((40.0, 0.01),), poles=((70.0, 0.02),)),
    Case("3 Hz steps", points=31),
    Case("3 Hz steps, zeta 0.01 / 0.02", points=31, zeros=((40.0, 0.01),), poles=((70.0, 0.02),)),
    Case("3 Hz steps, zeta 0.01 / 0.02, errors stated at a sixth", points=31,
         zeros=((40.0, 0.01),), poles=((70.0, 0.02),), noise=0.035, stated=1 / 6),
    Case("40 points in log f, 5 to 500 Hz", points=40, log=True, start=5.0, stop=500.0),
    Case("40 points in log f, zeta 0.005 / 0.01", points=40, log=True, start=5.0, stop=500.0,
         zeros=((40.0, 0.005),), poles=((70.0, 0.01),)),
    Case("uneven steps", points=61, jitter=0.45),
    Case("801 points", points=801, noise=0.05),
)  # fmt: skip
_NEIGHBOURS = (
    Case("130 / 145 Hz, zeta 0.02", zeros=((130.0, 0.02),), poles=((145.0, 0.02),),
         start=100.0, stop=180.0),
    Case("130 / 145 Hz, zeta 0.05, 61 points", zeros=((130.0, 0.05),), poles=((145.0, 0.05),),
         start=100.0, stop=180.0, points=61),
    Case("second pair at 140 / 200 Hz", zeros=((35.0, 0.02), (140.0, 0.03)),
         poles=((62.5, 0.05), (200.0, 0.05)), start=20.0, stop=260.0),
    Case("second pair at 80 / 90 Hz", zeros=((40.0, 0.03), (80.0, 0.03)),
         poles=((70.0, 0.05), (90.0, 0.03))),
    Case("small pair at 28 / 29 Hz", zeros=((28.0, 0.02), (45.0, 0.03)),
         poles=((29.0, 0.02), (70.0, 0.05)), points=361),
    Case("three pairs", zeros=((30.0, 0.02), (80.0, 0.03), (160.0, 0.02)),
         poles=((50.0, 0.03), (110.0, 0.03), (220.0, 0.04)), start=20.0, stop=300.0, points=281),
    Case("mode above the band", zeros=((40.0, 0.03), (125.0, 0.02)),
         poles=((70.0, 0.05), (140.0, 0.02))),
    Case("mode below the band", zeros=((12.0, 0.02), (40.0, 0.03)),
         poles=((16.0, 0.02), (70.0, 0.05))),
    Case("two resonances, one anti-resonance", zeros=((55.0, 0.03),),
         poles=((40.0, 0.03), (80.0, 0.04)), integrator=False),
)  # fmt: skip
_ODD = (
    Case("ARF above RF", zeros=((70.0, 0.03),), poles=((40.0, 0.05),)),
    Case("no zeros", zeros=(), poles=((70.0, 0.05),)),
    Case("no poles", poles=()),
    Case("nothing", zeros=(), poles=()),
    Case("nothing, and one spike", zeros=(), poles=(), spike=1.5),
    Case("a pair and one spike", spike=1.5),
)
CASES = _NOISES + _DAMPINGS + _GRIDS + _CORNERS + _NEIGHBOURS + _ODD


def frequencies(case: Case, rng: np.random.Generator | None = None) -> Vector:
    """The sweep, Hz."""
    spaced = np.geomspace if case.log else np.linspace
    f = spaced(case.start, case.stop, case.points)
    if rng is not None and case.jitter:
        f[1:-1] += case.jitter * rng.uniform(-1, 1, f.size - 2) * np.diff(f)[1:]
    return np.asarray(f)


def _pair(f: Vector, at: tuple[float, float]) -> NDArray[np.complex128]:
    return np.asarray(1 - (f / at[0]) ** 2 + 2j * at[1] * f / at[0])


def response(case: Case, f: Vector) -> NDArray[np.complex128]:
    """The true response."""
    h = np.exp(-2j * np.pi * f * case.delay_s)
    for zero in case.zeros:
        h = h * _pair(f, zero)
    for pole in case.poles + ((case.corner,) if case.corner else ()):
        h = h / _pair(f, pole)
    if case.lag:
        h = h / (1 + 1j * f / case.lag)
    return np.asarray(h * 30.0 / (1j * f) if case.integrator else h)


def truth(case: Case) -> list[tuple[int, float, float]]:
    """Sign, frequency in Hz and damping ratio of each feature inside the band."""
    f = np.linspace(case.start, case.stop, 400_001)
    g = np.abs(response(case, f))
    found = []
    for sign, pairs in ((-1, case.zeros), (1, case.poles)):
        k = np.flatnonzero((sign * g[1:-1] > sign * g[:-2]) & (sign * g[1:-1] >= sign * g[2:])) + 1
        for at, zeta in pairs:
            if k.size and case.start < at < case.stop:
                near = f[k][np.argmin(np.abs(f[k] - at))]
                if abs(near - at) < max(0.05, abs(zeta)) * at:
                    found.append((sign, float(near), abs(zeta)))
    return sorted(found, key=lambda one: one[1])


def measured(case: Case, draw: int) -> FrequencyResponse:
    """One sweep."""
    rng = np.random.default_rng([draw, zlib.crc32(case.name.encode())])
    f = frequencies(case, rng)
    h = response(case, f)
    size = np.full(f.size, case.noise * np.abs(h).max()) if case.absolute else case.noise * abs(h)
    h = h + size * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
    h[3 * f.size // 4] *= case.spike
    std = None if case.stated is None else case.stated * size / np.abs(h) * DB_PER_NEPER
    return FrequencyResponse.from_arrays(
        f, 1.0, h if case.phase else np.abs(h), unit="truth", phase_known=case.phase,
        gain_std_db=std,
    )  # fmt: skip


def run(draws: int) -> dict[str, Any]:
    """Every feature that is reported, by case and draw."""
    found: dict[str, Any] = {}
    for case in CASES:
        started = time.process_time()
        told = []
        for draw in range(draws):
            (level,) = to_json(extract(measured(case, draw)))["levels"]
            pairs = level.get("pairs") or [{"arf": level["arf"], "rf": level["rf"]}]
            features = []
            for pair in pairs:
                for sign, name in ((-1, "arf"), (1, "rf")):
                    one = pair[name]
                    if one is None:
                        continue
                    zeta = one.get("damping_ratio") or level["damping_ratio"][name]
                    features.append([sign, one["frequency_hz"], one["std_hz"],
                                     *((zeta["value"], zeta["std"]) if zeta else (None, None)),
                                     one["method"]])  # fmt: skip
            told.append(features)
        seconds = (time.process_time() - started) / draws
        found[case.name] = {"readings": told, "seconds": seconds}
    return found


def score(case: Case, told: Sequence[Sequence[Any]]) -> dict[str, float]:
    """Shares over all draws and features: found, held in frequency and in damping, made up."""
    true = truth(case)
    off, off_zeta, found, extra, error = [], [], 0, 0, []
    for features in told:
        taken = set()
        for sign, hz, std, zeta, zeta_std, _ in features:
            near = [
                (abs(math.log(hz / at)), k)
                for k, (kind, at, _) in enumerate(true)
                if kind == sign and k not in taken and abs(math.log(hz / at)) < NEAR
            ]
            if not near:
                extra += 1
                continue
            k = min(near)[1]
            taken.add(k)
            found += 1
            off.append((hz - true[k][1]) / std)
            error.append((hz - true[k][1]) / true[k][1])
            if zeta is not None:
                off_zeta.append((zeta - true[k][2]) / zeta_std)
    n = max(len(told) * len(true), 1)

    def held(values: list[float]) -> float:
        return float(np.mean(np.abs(values) < 1.96)) if values else math.nan

    return {
        "found": found / n if true else math.nan,
        "frequency": held(off),
        "damping": held(off_zeta),
        "extra": extra / len(told),
        "rms_percent": 100.0 * float(np.sqrt(np.mean(np.square(error)))) if error else math.nan,
    }


def table(new: dict[str, Any], old: dict[str, Any] | None) -> str:
    """The scores as rows of a table: found, frequency held, damping held, made up, error."""
    lines = []
    for case in CASES:
        cells = []
        for readings in (old, new):
            if readings is None:
                continue
            one = score(case, readings[case.name]["readings"])
            cells += [
                *(_percent(one[key]) for key in ("found", "frequency", "damping")),
                f"{one['extra']:.2f}",
                "-" if math.isnan(one["rms_percent"]) else f"{one['rms_percent']:.2g}",
            ]
        lines.append("| " + " | ".join([case.name, *cells]) + " |")
    return "\n".join(lines)


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100 * share:.0f}"


def main(arguments: Sequence[str]) -> None:
    """Run or compare; see the module."""
    if arguments[0] == "run":
        draws = int(arguments[2]) if len(arguments) > 2 else 100
        Path(arguments[1]).write_text(json.dumps(run(draws)))
    else:
        files = [json.loads(Path(name).read_text()) for name in arguments[1:]]
        print(table(files[0], files[1] if len(files) > 1 else None))


if __name__ == "__main__":
    main(sys.argv[1:])
