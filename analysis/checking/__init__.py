"""Checks of one model against the measurement: goodness of fit, cross-validation, plausibility.

Owns reasons to reject a model by itself. It compares no two models' probabilities.
"""
