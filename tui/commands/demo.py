"""``lashbench demo``: the whole job without hardware."""

from tui.output import Injected

__all__ = ["demo"]


def demo(*, console: Injected) -> None:
    """Do the whole job."""
