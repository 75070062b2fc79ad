"""``lashbench extract``: ARF, RF and damping of a response.

Owns the options of the verb and its table. What a feature is, and how sure
it is, is decided by the analysis.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tui.options import Json
from tui.output import Injected, aligned

__all__ = ["extract", "feature_table"]


def extract(file: Path, /, *, json: Json = False, console: Injected) -> None:
    """Read anti-resonance, resonance and damping out of a response, per source level.

    Parameters
    ----------
    file
        Response as csv, h5, uff, mat or the analyser's own sdf.
    """
    from analysis.resonance import extract as features_of
    from analysis.resonance import to_json
    from daq.formats import read_response

    document = to_json(features_of(read_response(file)))
    if json:
        console.document(document)
    else:
        console.data(feature_table(document))


def feature_table(document: Mapping[str, Any]) -> str:
    """The features of each level as a plain-text table, flags below it."""
    headers = ["level V", "ARF Hz", "dB", "RF Hz", "dB", "RF - ARF Hz", "zeta ARF", "zeta RF"]
    rows, flags = [], []
    for level in document["levels"]:
        name = f"{level['source_vpk']:g}"
        rows.append(
            [
                name,
                *_frequency(level["arf"]),
                *_frequency(level["rf"]),
                _value(level["difference_hz"], "value", "std"),
                *(_number(level["damping_ratio"], key, ".3f") for key in ("arf", "rf")),
            ]
        )
        flags += [f"{name} V: {flag}" for flag in level["flags"]]
    return "\n".join([aligned(headers, rows), *flags])


def _frequency(feature: Mapping[str, Any] | None) -> list[str]:
    return [_value(feature, "frequency_hz", "std_hz"), _number(feature, "gain_db", ".1f")]


def _value(feature: Mapping[str, Any] | None, key: str, std: str) -> str:
    if feature is None or feature[key] is None:
        return "-"
    return f"{feature[key]:.1f} +- {_number(feature, std, '.1f')}"


def _number(feature: Mapping[str, Any] | None, key: str, form: str) -> str:
    value = None if feature is None else feature[key]
    return "-" if value is None else format(value, form)
