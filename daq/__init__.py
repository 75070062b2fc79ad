"""The bench: frequency responses, sweep plans, instruments, sessions and files.

The lowest of the four floors. It knows nothing of physics, judgement or
screens: a simulated analyser is met through a transport, as a real one is.
"""

__distribution__ = "lashbench"
"""Another distribution may bring a package of this name; `tui.entry` tells them apart."""

__all__ = [
    "adaptive",
    "analyser",
    "configs",
    "control",
    "errors",
    "formats",
    "frf",
    "hp35670a",
    "limits",
    "plan",
    "recipe",
    "session",
    "session_events",
    "session_request",
    "store",
    "store_records",
    "transports",
]
"""The modules whose names others may rely on; docs/api.md lists them."""
