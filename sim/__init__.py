"""Physics: drivetrain elements, the engine that steps them, effects, and the simulated analyser.

The second floor. It knows how a geared servo moves and nothing about judging
a measurement.
"""

__distribution__ = "lashbench"
"""Another distribution may bring a package of this name; `tui.entry` tells them apart."""

__all__ = [
    "analyser35670a",
    "catalogue",
    "drivetrain",
    "effects",
    "elements",
    "faults",
    "loopback",
    "response",
    "serve",
    "unit",
]
"""The modules whose names others may rely on; docs/api.md lists them."""
