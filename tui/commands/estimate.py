"""``lashbench estimate``: how much of the backlash sits in each stage.

Owns the options of the verb and which of them go together. The estimate and
its uncertainty are the analysis's.
"""

from __future__ import annotations

from pathlib import Path

from daq.errors import InputError
from tui.options import Json, Real, UnitName
from tui.output import Injected

__all__ = ["estimate"]


def estimate(
    file: Path | None = None,
    /,
    *,
    unit: UnitName,
    arf_hz: Real | None = None,
    rf_hz: Real | None = None,
    total_backlash_unknown: bool = False,
    json: Json = False,
    console: Injected,
) -> None:
    """Estimate the contribution of stage 1 to the total backlash.

    Give either a response or the two frequencies read from one.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    arf_hz
        Anti-resonance in Hz, in place of a file.
    rf_hz
        Resonance in Hz, in place of a file.
    total_backlash_unknown
        Estimate the total backlash too, instead of taking the unit's.
    """
    if file is not None and (arf_hz is not None or rf_hz is not None):
        raise InputError(f"{file}: give either a response or --arf-hz and --rf-hz, not both")
    if file is None and (arf_hz is None or rf_hz is None):
        raise InputError("nothing to estimate from; give a response, or both --arf-hz and --rf-hz")
    if file is None and total_backlash_unknown:
        raise InputError(
            "--total-backlash-unknown needs a response at several source levels; "
            "two frequencies cannot tell it"
        )
    from sim.unit import load_unit

    subject = load_unit(unit)
    if file is None:
        from analysis.estimate import estimate_features

        result = estimate_features(arf_hz, rf_hz, subject, progress=console.progress)
    else:
        from analysis.estimate import estimate_response
        from daq.formats import read_response

        result = estimate_response(
            read_response(file),
            subject,
            total_backlash_unknown=total_backlash_unknown,
            progress=console.progress,
        )
    if json:
        console.document(result.to_json())
    else:
        console.data("\n".join(result.summary()))
