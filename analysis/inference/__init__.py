"""Amortised Bayesian inference: one prior, one simulator, one posterior for a unit.

Owns the prior over causes, sizes, contribution ratio, datasheet errors and sweep plans, and the
training runs that are drawn from it. Nothing here reads a file of measurements.
"""
