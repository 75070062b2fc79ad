"""The signal that drove a servo where it was no stepped sine: its lines, and what is averaged.

Owns the description, its checks, its form in a file (`SIGNAL_KEY` of the provenance), and the
usual signals: multisine, repeated chirp, random noise. It knows no servo and estimates nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from daq.errors import InputError

__all__ = [
    "MOST_LINES",
    "SIGNAL_KEY",
    "WORDS",
    "Excitation",
    "Kind",
    "chirp",
    "excitation_of",
    "multisine",
    "noise",
]

SIGNAL_KEY = "excitation_signal"
"""Provenance key: the document of `Excitation.to_json`."""

MOST_LINES = 20_000

Kind = Literal["periodic", "noise"]

WORDS: Mapping[Kind, str] = {"periodic": "a periodic signal", "noise": "noise"}
"""Of `excitation` in a provenance, by which a person knows the signal."""

_KEYS = {"kind", "period_s", "lines", "amplitude", "phase_deg"}


@dataclass(frozen=True, slots=True)
class Excitation:
    """A signal by its lines, multiples of 1 / period; its rms is that of a sine of 1 V peak.

    Parameters
    ----------
    kind
        ``"periodic"``: one period is repeated, and the response is the mean over periods.
        ``"noise"``: Gaussian, the response is H1 over Hann segments that overlap by half.
    period_s
        Length of a period or of a segment, s.
    lines
        Ascending whole numbers of 1 or more.
    amplitude
        Of each line; of noise in the mean. Only their proportions count.
    phase_deg
        Phase of each line of a periodic signal, sin(2 pi f t + phase); empty for noise.

    Raises
    ------
    InputError
        If a value is outside what a signal can be.
    """

    kind: Kind
    period_s: float
    lines: tuple[int, ...]
    amplitude: tuple[float, ...]
    phase_deg: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise _wrong("kind", self.kind, "periodic or noise")
        if not (np.isfinite(self.period_s) and self.period_s > 0.0):
            raise _wrong("period_s", self.period_s, "a number of s above 0")
        lines, amplitude = np.asarray(self.lines), np.asarray(self.amplitude, dtype=float)
        if not 1 <= lines.size <= MOST_LINES:
            raise _wrong("lines", f"{lines.size} of them", f"1 to {MOST_LINES}")
        if lines.dtype.kind not in "iu" or lines[0] < 1 or np.any(np.diff(lines) <= 0):
            raise _wrong("lines", self.lines[:4], "ascending whole numbers of 1 or more")
        if amplitude.shape != lines.shape or not np.all(np.isfinite(amplitude)):
            raise _wrong("amplitude", f"{amplitude.size} numbers", f"{lines.size} numbers")
        if np.any(amplitude < 0.0) or not np.any(amplitude > 0.0):
            raise _wrong("amplitude", "negative or all 0", "positive numbers")
        wanted = lines.size if self.kind == "periodic" else 0
        phase = np.asarray(self.phase_deg, dtype=float)
        if phase.size != wanted or not np.all(np.isfinite(phase)):
            raise _wrong("phase_deg", f"{phase.size} numbers", f"{wanted} numbers")

    @property
    def frequencies_hz(self) -> NDArray[np.float64]:
        """Of the lines, (lines,), Hz."""
        return np.asarray(self.lines, dtype=float) / self.period_s

    @property
    def amplitudes(self) -> NDArray[np.float64]:
        """(lines,), of a signal whose rms is that of a sine of 1 V peak, V peak."""
        raw = np.asarray(self.amplitude, dtype=float)
        return np.asarray(raw / np.sqrt(np.sum(raw**2)))

    def phasors(self) -> NDArray[np.complex128]:
        """(lines,) of a periodic signal: u(t) = Im(sum_k phasor_k exp(2 pi i f_k t)), V peak."""
        turned = self.amplitudes * np.exp(1j * np.radians(self.phase_deg))
        return np.asarray(turned, dtype=complex)

    def drawn(
        self, rng: np.random.Generator, segments: int
    ) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
        """A record of noise so many segments long, as one period of a periodic signal.

        Returns
        -------
        tuple
            Its lines, multiples of 1 / (segments period_s), and their phasors (see `phasors`);
            their power lies between that of the given lines.
        """
        first = max(1, self.lines[0] * segments - segments // 2)
        fine = np.arange(first, self.lines[-1] * segments + segments // 2 + 1)
        size = np.sqrt(np.interp(fine / segments, self.lines, self.amplitudes**2))
        random = size * (rng.normal(size=fine.size) + 1j * rng.normal(size=fine.size))
        return fine, random / np.sqrt(np.sum(np.abs(random) ** 2))

    def nearest(self, frequencies_hz: Any) -> NDArray[np.intp]:
        """Index of the line at each frequency.

        Raises
        ------
        InputError
            If there is none within a hundredth of the spacing.
        """
        wanted = np.atleast_1d(np.asarray(frequencies_hz, dtype=float)) * self.period_s
        lines = np.asarray(self.lines, dtype=float)
        at = np.clip(np.searchsorted(lines, wanted - 0.5), 0, lines.size - 1)
        off = np.abs(lines[at] - wanted)
        if np.any(off > 0.01 + 1e-5 * wanted):
            stray = float(np.atleast_1d(frequencies_hz)[int(np.argmax(off))])
            raise InputError(
                f"{SIGNAL_KEY}: the response holds {stray:.6g} Hz, which the signal does not "
                f"drive; its lines are multiples of {1.0 / self.period_s:.6g} Hz"
            )
        return at

    def stated(self) -> dict[str, Any]:
        """What the provenance of its response says of it."""
        return {"excitation": WORDS[self.kind], SIGNAL_KEY: self.to_json()}

    def to_json(self) -> dict[str, Any]:
        """The document that files keep."""
        document: dict[str, Any] = {
            "kind": self.kind,
            "period_s": self.period_s,
            "lines": list(self.lines),
            "amplitude": [float(f"{a:.5g}") for a in self.amplitudes],
        }
        if self.kind == "periodic":
            document["phase_deg"] = [round(p, 3) for p in self.phase_deg]
        return document


def excitation_of(provenance: Mapping[str, Any]) -> Excitation | None:
    """The signal that a provenance states; None where it states none.

    Raises
    ------
    InputError
        If what it states is no such document; says which value.
    """
    stated = provenance.get(SIGNAL_KEY)
    if stated is None:
        return None
    if not isinstance(stated, Mapping) or not _KEYS - {"phase_deg"} <= set(stated) <= _KEYS:
        raise _wrong("its keys", sorted(stated) if isinstance(stated, Mapping) else stated,
                     ", ".join(sorted(_KEYS)))  # fmt: skip
    period = stated["period_s"]
    if isinstance(period, bool) or not isinstance(period, int | float):
        raise _wrong("period_s", period, "a number of s above 0")
    return Excitation(
        stated["kind"],
        float(period),
        tuple(_numbers(stated, "lines", int)),
        tuple(map(float, _numbers(stated, "amplitude", int | float))),
        tuple(map(float, _numbers(stated, "phase_deg", int | float))),
    )


def multisine(
    frequencies_hz: Sequence[float], period_s: float, phases: Literal["schroeder", "random"],
    seed: int = 0,
) -> Excitation:  # fmt: skip
    """Lines of one amplitude at the multiples of 1 / period nearest to some frequencies.

    Schroeder's phases (IEEE Trans. Inf. Theory 16 (1970) 85) keep the peaks low.
    """
    lines = _lines_at(frequencies_hz, period_s)
    n = np.arange(lines.size)
    phase = -180.0 * n * (n - 1.0) / lines.size
    if phases == "random":
        phase = 360.0 * np.random.default_rng(seed).random(lines.size)
    return Excitation(
        "periodic", period_s, tuple(lines.tolist()), (1.0,) * lines.size,
        tuple((phase % 360.0).tolist()),
    )  # fmt: skip


def chirp(start_hz: float, stop_hz: float, period_s: float) -> Excitation:
    """A linear sweep that is repeated, by its lines within the band.

    Raises
    ------
    InputError
        If the band holds no line.
    """
    lines = _band(start_hz, stop_hz, period_s)
    count = 8 * int(np.ceil(stop_hz * period_s) + 8)
    t = np.arange(count) / count * period_s
    turns = start_hz * t + 0.5 * (stop_hz - start_hz) / period_s * t**2
    spectrum = np.fft.rfft(np.sin(2.0 * np.pi * turns))[lines] * 1j
    return Excitation(
        "periodic", period_s, tuple(lines.tolist()), tuple(np.abs(spectrum).tolist()),
        tuple(np.degrees(np.angle(spectrum)).tolist()),
    )  # fmt: skip


def noise(start_hz: float, stop_hz: float, period_s: float) -> Excitation:
    """Gaussian noise, white from start to stop."""
    lines = _band(start_hz, stop_hz, period_s)
    return Excitation("noise", period_s, tuple(lines.tolist()), (1.0,) * lines.size)


def _band(start_hz: float, stop_hz: float, period_s: float) -> NDArray[np.int64]:
    lines = np.arange(
        max(1, int(np.ceil(start_hz * period_s - 1e-6))), int(stop_hz * period_s + 1e-6) + 1
    )
    if not lines.size:
        raise InputError(
            f"no multiple of {1.0 / period_s:g} Hz lies between {start_hz:g} and {stop_hz:g} Hz; "
            "give a finer resolution"
        )
    return lines


def _lines_at(frequencies_hz: Sequence[float], period_s: float) -> NDArray[np.int64]:
    wanted = np.asarray(frequencies_hz, dtype=float) * period_s
    return np.unique(np.maximum(np.round(wanted), 1).astype(np.int64))


def _numbers(stated: Mapping[str, Any], key: str, kind: Any) -> list[Any]:
    values = stated.get(key, [])
    values = values.tolist() if hasattr(values, "tolist") else values
    if not isinstance(values, list | tuple) or len(values) > MOST_LINES:
        raise _wrong(key, type(values).__name__, f"a list of up to {MOST_LINES} numbers")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, kind):
            raise _wrong(key, value, "numbers")
    return list(values)


def _wrong(key: str, value: Any, right: str) -> InputError:
    return InputError(f"{SIGNAL_KEY}: {key} {str(value)[:60]!r} is not possible; give {right}")
