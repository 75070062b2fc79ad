"""What a report holds, as one document for programs: the same that its page shows.

Owns the fields of the machine-readable copy and its hashes. It draws nothing,
words nothing and computes no estimate.
"""

from __future__ import annotations

import hashlib
import json
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from analysis.acceptance import Judgement
from analysis.report.certificate import Certificate, certificate_data
from analysis.resonance import LevelFeatures
from analysis.resonance.records import to_json
from daq.frf import FrequencyResponse
from sim.datasheet.chain import loop_words
from sim.unit import Unit

__all__ = ["FORMAT", "Origin", "data_hash", "report_data", "response_columns"]

FORMAT = "lashbench-report"
VERSION = 1

_PACKAGES = ("lashbench", "numpy", "scipy", "numba", "matplotlib")
_APART = ("configurations", "points", "readback", "instrument")
"""Parts of a provenance that have a place of their own in the document."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the response came from.

    Parameters
    ----------
    name
        The file, or the measurement and its history, in words.
    file_sha256
        SHA-256 of the file's bytes; None for a stored measurement.
    facts
        What is known beside the response's provenance: when it ended, the
        state of the source, how many points are flagged.
    """

    name: str
    file_sha256: str | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)


def report_data(
    response: FrequencyResponse,
    unit: Unit,
    origin: Origin,
    features: tuple[LevelFeatures, ...],
    estimate: Mapping[str, Any] | None,
    diagnosis: Mapping[str, Any] | None,
    remarks: Mapping[str, str],
    made: datetime,
    judgement: Judgement | None = None,
    certificate: Certificate | None = None,
) -> dict[str, Any]:
    """Put the document together; whatever is not a finite number is null."""
    known = dict(response.provenance)
    configurations = {k: str(v) for k, v in dict(known.get("configurations") or {}).items()}
    columns = response_columns(response)
    closed = {} if unit.loop is None else {"loop": "; ".join(loop_words(unit.loop))}
    content: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "made": made.isoformat(timespec="seconds"),
        "unit": {
            "name": unit.name,
            "document": unit.model_dump(by_alias=True, mode="json"),
            **closed,
        },
        "origin": {"name": origin.name, **origin.facts},
        "simulated": known.get("kind") == "simulated",
        "measurement": {k: v for k, v in known.items() if k not in _APART},
        "instrument": known.get("instrument"),
        "readback": known.get("readback") or {},
        "procedure": {
            "unit": response.unit,
            "direction": response.direction,
            "settle_cycles": response.settle_cycles,
            "integrate_cycles": response.integrate_cycles,
            "from_rest": response.from_rest,
        },
        "features": to_json(features),
        "estimate": estimate,
        "diagnosis": diagnosis,
        "judgement": None if judgement is None else judgement.to_json(),
        "remarks": dict(remarks),
        "response": columns,
        "provenance": {
            "software": {name: _version(name) for name in _PACKAGES},
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}",
            "response_sha256": data_hash(columns),
            "file_sha256": origin.file_sha256,
            "configurations": {
                kind: {"sha256": _sha256(text), "text": text}
                for kind, text in configurations.items()
            },
        },
    }
    content["certificate"] = certificate_data(certificate or Certificate(), content)
    plain: dict[str, Any] = _plain(content)
    return plain


def response_columns(response: FrequencyResponse) -> dict[str, list[Any]]:
    """Every row of a response, column by column; None where a value is not known."""
    columns = {
        "frequency_hz": response.frequency_hz,
        "source_vpk": response.source_vpk,
        "gain_db": response.gain_db,
        "phase_deg": response.phase_deg,
        "gain_std_db": response.gain_std_db,
        "phase_std_deg": response.phase_std_deg,
        "flags": response.flags,
    }
    return {name: _plain(values) for name, values in columns.items()}


def data_hash(columns: Mapping[str, Any]) -> str:
    """SHA-256 of a response's columns as compact JSON with sorted keys, UTF-8."""
    return _sha256(json.dumps(columns, sort_keys=True, separators=(",", ":"), allow_nan=False))


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _plain(value: Any) -> Any:
    """Lists, dictionaries, text and finite numbers only."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    return str(value)
