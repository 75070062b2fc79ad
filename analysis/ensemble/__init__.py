"""Machines that are simulated for an observation: which, in which batches, and their kept runs.

Owns the model of a unit with causes, and the runs of it. It compares nothing with a measurement.
"""
