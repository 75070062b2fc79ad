"""Records of a simulated linear servo whose response is known exactly, for every excitation.

Owns the servo, a filter of 4 poles, and the signals. Its truth is that filter's own frequency
response.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import bilinear, chirp, freqz, lfilter

RATE = 1000.0


def servo(rate=RATE):
    """Numerator and denominator of the servo, sampled."""

    def pair(hz, zeta):
        w = 2 * np.pi * hz
        return np.array([1 / w**2, 2 * zeta / w, 1.0])

    den = np.polymul(pair(70.0, 0.05), pair(200.0, 0.7))
    b, a = bilinear(pair(40.0, 0.03) * 0.5, den, rate)
    return b, a


def truth(f, rate=RATE):
    """The exact response."""
    return freqz(*servo(rate), worN=2 * np.pi * np.asarray(f) / rate)[1]


def driven(x, rng, noise=0.0, input_noise=0.0, rate=RATE):
    """Input and output as they are recorded."""
    y = lfilter(*servo(rate), x)
    return x + input_noise * rng.normal(size=x.size), y + noise * rng.normal(size=x.size)


def stepped(f, levels=(1.0,), cycles=60, rate=RATE):
    """A sine that steps through frequencies at each level, its phase carried on."""
    parts, phase = [], 0.0
    for level in levels:
        for hz in f:
            n = round(cycles / hz * rate)
            turn = phase + 2 * np.pi * hz / rate * np.arange(n)
            parts.append(level * np.sin(turn))
            phase = turn[-1] + 2 * np.pi * hz / rate
    return np.concatenate(parts)


def swept(seconds=60.0, low=15.0, high=120.0, method="linear", rate=RATE):
    """One chirp."""
    t = np.arange(round(seconds * rate)) / rate
    return chirp(t, low, seconds, high, method=method)


def multisine(periods=8, seconds=4.0, low=15.0, high=120.0, rate=RATE, seed=0):
    """Lines of random phase, repeated."""
    n = round(seconds * rate)
    k = np.arange(round(low * seconds), round(high * seconds))
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    spectrum[k] = np.exp(2j * np.pi * np.random.default_rng(seed).random(k.size))
    one = np.fft.irfft(spectrum)
    return np.tile(one / np.std(one), periods)


def noise(rng, seconds=60.0, rate=RATE):
    """White noise."""
    return rng.normal(size=round(seconds * rate))
