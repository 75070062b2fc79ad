"""Measurements of the simulated 35670A: sweeps, points, spectra and their traces.

Owns what is read of the simulated servo. It knows no wire.
"""
