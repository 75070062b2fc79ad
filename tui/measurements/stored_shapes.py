"""What a stored estimate or diagnosis must look like to be shown: a file may hold anything.

Owns the fields that screens and reports read, and of which kind each is. A document may
hold more; what is left out is left out where it is shown. It reads no file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

__all__ = ["fault_of"]

_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Text = Annotated[str, Field(max_length=65536)]
_Texts = Annotated[list[_Text], Field(max_length=1000)]


class _Shape(BaseModel):
    model_config = ConfigDict(extra="allow", strict=True)


_Probability = Annotated[float, Field(ge=0.0, le=1.0 + 1e-9)]
_Error = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_MOST_DEG = 360.0


class _Number(_Shape):
    value: _Finite
    std: _Error | None = None
    interval95: Annotated[list[_Finite], Field(min_length=2, max_length=2)] | None = None


class _Ratio(_Number):
    """A contribution ratio: 0 to 1, and what a normal distribution has beyond."""

    value: Annotated[float, Field(ge=-0.5, le=1.5)]


class _Degrees(_Number):
    """A backlash, degrees."""

    value: Annotated[float, Field(ge=-_MOST_DEG, le=_MOST_DEG)]


class _Open(_Shape):
    """A contribution ratio that may not be known."""

    value: Annotated[float, Field(ge=-0.5, le=1.5)] | None
    std: _Error | None = None


class _Index(_Shape):
    ratio: list[_Finite]
    hz: list[_Finite | None]
    std_hz: list[_Finite | None]
    minimum_ratio: _Finite


class _Sweep(_Shape):
    levels_vpk: list[_Finite]
    start_hz: _Finite
    stop_hz: _Finite
    points: int
    direction: _Text
    dc_offset_v: _Finite = 0.0


class _Model(_Shape):
    causes: _Texts
    probability: _Probability | None = None
    contribution_ratio: _Ratio | None = None
    b1_deg: _Degrees | None = None
    b2_deg: _Degrees | None = None
    b_t_deg: _Degrees | None = None


class _Said(_Shape):
    """What both kinds may say."""

    b1_deg: _Degrees | None = None
    b2_deg: _Degrees | None = None
    b_t_deg: _Degrees | None = None
    sweeps: list[_Sweep] = []
    warnings: _Texts = []


class _Estimate(_Said):
    contribution_ratio: _Ratio
    error_index: _Index | None = None
    refuted: bool | None = None


class _Size(_Shape):
    value: _Finite | None
    std: _Finite | None = None
    unit: _Text = ""
    datasheet: _Finite | None = None


class _Cause(_Shape):
    effect: _Text
    parameters: dict[str, _Size] = {}
    probability: _Probability
    site: _Text = ""
    meaning: _Text = ""
    check: _Text = ""


class _Rival(_Shape):
    causes: _Texts
    probability: _Probability
    remark: _Text | None = None
    site: _Texts = []


class _HeldOut(_Shape):
    held_out_rms_sigma: _Finite | None
    held_out_rms_db: _Finite | None


class _Gain(_Shape):
    held_out_rms_ratio: _Finite | None


class _Ratios(_Shape):
    baseline: _Open
    extended: _Open


class _Departure(_Shape):
    band_hz: Annotated[list[_Finite], Field(min_length=2, max_length=2)]
    source_vpk: _Finite
    quantity: _Text
    mean: _Finite
    sigma: _Finite
    sweep: int = 0


_Readings = list[_Finite | None]


class _Predicted(_Shape):
    gain_db: _Readings
    gain_std_db: _Readings
    phase_deg: _Readings
    phase_std_deg: _Readings


class _Prediction(_Shape):
    """Rows of readings; all lists have one length."""

    source_vpk: list[_Finite]
    frequency_hz: list[_Finite]
    sweep: list[int]
    gain_db: _Readings
    phase_deg: _Readings
    baseline: _Predicted
    extended: _Predicted | None

    @model_validator(mode="after")
    def _of_one_length(self) -> Self:
        rows = len(self.frequency_hz)
        lists: list[list[Any]] = [self.source_vpk, self.sweep, self.gain_db, self.phase_deg]
        for model in (self.baseline, self.extended):
            if model is not None:
                lists += [model.gain_db, model.gain_std_db, model.phase_deg, model.phase_std_deg]
        if any(len(one) != rows for one in lists):
            raise ValueError("lists of different lengths")
        return self


class _Unseen(_Shape):
    effect: _Text
    parameter: _Text | None = None
    unit: _Text
    low: _Finite | None
    high: _Finite | None
    datasheet: _Finite | None = None


class _Proposal(_Shape):
    plan: dict[str, Any]
    separates: Annotated[list[_Text], Field(min_length=2, max_length=2)]
    expected_sigma: _Finite | None = None


class _Diagnosis(_Said):
    verdict: Literal["consistent", "explained", "ambiguous", "unexplained"]
    causes: list[_Cause]
    rivals: list[_Rival]
    baseline: _HeldOut
    extended: _HeldOut
    gain: _Gain
    contribution_ratio: _Ratios
    residual: list[_Departure] = []
    residual_after: list[_Departure] = []
    shape: _Text = ""
    shape_after: _Text = ""
    unseen: list[_Unseen] = []
    models: list[_Model] = []
    next_measurement: _Proposal | None = None
    prediction: _Prediction | None = None
    elapsed_s: _Finite | None = None


class _EstimateLine(_Said):
    """Of an estimate, what a list shows."""

    contribution_ratio: _Ratio | None = None
    refuted: bool | None = None
    failed: _Text | None = None
    warnings: _Texts | None = None  # type: ignore[assignment]


class _CauseLine(_Shape):
    effect: _Text
    probability: _Probability


class _DiagnosisLine(_Said):
    verdict: Literal["consistent", "explained", "ambiguous", "unexplained"]
    causes: list[_CauseLine]
    contribution_ratio: _Ratios
    models: list[_Model] = []


_KINDS: Mapping[str, type[_Shape]] = {
    "estimate": _Estimate,
    "diagnosis": _Diagnosis,
    "estimate line": _EstimateLine,
    "diagnosis line": _DiagnosisLine,
}


def fault_of(kind: str, document: Mapping[str, Any]) -> str:
    """What is wrong with a document, in one line; empty if nothing is.

    Parameters
    ----------
    kind
        "estimate" or "diagnosis", or one with " line" behind it for what a list shows.
    """
    try:
        _KINDS[kind].model_validate(dict(document))
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(str(part)[:40] for part in first["loc"])
        return f"{place}: {first['msg']}"
    except RecursionError:
        return "it is nested too deeply"
    return ""
