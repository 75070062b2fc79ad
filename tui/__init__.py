"""What people touch: the command line and the terminal application.

The top floor. It talks to people and computes nothing itself.
"""

__distribution__ = "lashbench"
"""Another distribution may bring a package of this name; `tui.entry` tells them apart."""

__all__ = ["bench", "cli"]
"""The modules whose names others may rely on; docs/api.md lists them."""
