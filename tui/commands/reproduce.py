"""``lashbench reproduce``: the paper's results beside the published numbers.

Owns the options of the verb only.
"""

from __future__ import annotations

from tui.options import Json, Plots, directory_to_fill
from tui.text.output import Injected

__all__ = ["reproduce"]


def reproduce(*, json: Json = False, plots: Plots = None, console: Injected) -> None:
    """Compute Table 2, the figures and section 5 of the paper beside the published numbers.

    The paper is Baek, Kwak and Kim, Int. J. Adv. Manuf. Technol. 21 (2003) 604.
    """
    with directory_to_fill(plots):
        result = console.compute.reproduce(progress=console.progress)
        if plots is not None:
            result.plot(plots)
            console.note(f"wrote figures to {plots}")
    if json:
        console.document(result.to_json())
    else:
        console.data("\n".join(result.summary()))
