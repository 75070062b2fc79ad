"""Commands that are printed so that somebody pastes them into a shell.

Owns how they name what was given on the command line: a unit of one's own is found by the path
of its file alone, and a name that comes with lashbench may stand for another machine. A bench is
where the measurement says it was made.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from analysis.diagnosis import Diagnosis
    from analysis.paper_diagnosis import PaperDiagnosis
    from daq.frf import FrequencyResponse

__all__ = ["pip_install", "pasted", "proposing"]

Proposer = TypeVar("Proposer", "Diagnosis", "PaperDiagnosis")


def pasted(words: Sequence[str]) -> str:
    """Words as the shell of this system reads them back."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def pip_install(*words: str) -> str:
    """The command that installs something for the Python that runs this, wherever that lies."""
    return pasted([sys.executable, "-m", "pip", "install", *words])


def proposing(result: Proposer, unit: str, measured: Sequence[FrequencyResponse] = ()) -> Proposer:
    """A diagnosis whose proposed command names the unit as it was given, and the bench.

    Parameters
    ----------
    unit
        Name of a unit that comes with lashbench, or the path of a file.
    measured
        What was diagnosed. The last that tells where it was measured, or whose number the specimen
        has, is believed.
    """
    proposal = result.next_measurement
    if proposal is None:
        return result
    address, serial = (_last_said(key, measured) for key in ("address", "serial"))
    if address.startswith("replay:"):
        # A transcript answers what it was asked, and nothing else.
        address = ""
    named = replace(proposal, unit=unit, address=address, serial=serial)
    return replace(result, next_measurement=named)


def _last_said(key: str, measured: Sequence[FrequencyResponse]) -> str:
    said = [str(one.provenance.get(key) or "") for one in measured]
    # What moves a terminal's cursor is no address, and nothing to paste.
    return next((text for text in reversed(said) if text and text.isprintable()), "")
