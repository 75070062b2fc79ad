"""Whether two ways to simulate scatter alike, by a permutation test; for the tests alone."""

import numpy as np

FLOOR = 0.01
"""Differences well below this share of the gain do not count: both sides have a step."""

PERMUTATIONS = 4999


def mean_and_scatter(cycles):
    """Of each run (runs, cycles): real and imaginary mean over the pooled gain, log of scatter."""
    scale = np.abs(cycles.mean())
    mean = cycles.mean(axis=1)
    scatter = np.sqrt((np.abs(cycles - mean[:, None]) ** 2).mean(axis=1))
    return (
        np.stack([mean.real, mean.imag], axis=1) / scale,
        np.log(scatter / scale + FLOOR)[:, None],
    )


def apart(values, first):
    """Squared distance of two group means in units of the pooled spread; `first` picks one group.

    `values` (runs, k), `first` (permutations, runs) of zeros and ones.
    """
    spread = np.sqrt(values.var(axis=0) + FLOOR**2)
    whole = values / spread
    one = first @ whole / first.sum(axis=1, keepdims=True)
    other = (1.0 - first) @ whole / (1.0 - first).sum(axis=1, keepdims=True)
    return np.sum((one - other) ** 2, axis=1)


def permutation_p(groups, rng):
    """P-values that two simulations differ in mean and in scatter, over all frequencies.

    `groups` holds per frequency the cycles of the one and of the other, each (runs, cycles), of
    starts drawn for it. If both come from one distribution the labels are exchangeable within a
    frequency, so p <= a happens with probability a at most, whatever the distribution is.
    """
    totals = np.zeros((2, PERMUTATIONS + 1))
    for ours, theirs in groups:
        labels = np.repeat([1.0, 0.0], [len(ours), len(theirs)])
        first = np.tile(labels, (PERMUTATIONS + 1, 1))
        first[1:] = rng.permuted(first[1:], axis=1)
        for row, values in enumerate(mean_and_scatter(np.concatenate([ours, theirs]))):
            totals[row] += apart(values, first)
    return (totals >= totals[:, :1]).mean(axis=1)
