"""How far the values of a datasheet may be off: which have a tolerance, and what is believed.

Owns the names of ``[tolerance]`` in a unit file and of ``--tolerance``, the shares by kind that are
taken where nobody gives one, how limits with a distribution become a standard deviation, and which
of several counts. What follows from them is the analysis's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError

from daq.untrusted.toml_files import Positive, Section

__all__ = ["DEFAULT", "MOST", "USUAL", "Share", "believed_shares", "find_fault", "response_scales"]

MOST = 0.5
"""Largest tolerance: a value that is known no better is not known."""

_DIVISORS = {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0), "normal": 1.96}
"""Half-width over standard deviation (JCGM 100:2008, 4.3); limits of a normal one hold 95 %."""


class _Limits(Section):
    """Limits of a datasheet value: it is off by no more than so large a share."""

    within: Positive
    distribution: Literal["uniform", "triangular", "normal"] = "uniform"


def _standard_deviation(value: Any) -> Any:
    """Limits as one standard deviation; what is none stays, to be checked as a number."""
    if not isinstance(value, Mapping):
        return value
    try:
        limits = _Limits.model_validate(dict(value))
    except ValidationError as error:
        keys = ", ".join(".".join(map(str, fault["loc"])) for fault in error.errors())
        raise ValueError(
            f"{keys}: limits are written {{ within = 0.1, distribution = "
            '"uniform" }, or triangular, or normal'
        ) from None
    return limits.within / _DIVISORS[limits.distribution]


Share = Annotated[float, BeforeValidator(_standard_deviation), Field(ge=0, le=MOST)]
"""One standard deviation of a datasheet value, as a share of it."""

DEFAULT = "default"
"""Key of the tolerance of all values that none is given for."""

USUAL = 0.05
"""Of a value of which nobody said how good it is, and which is of no kind below."""

_BY_KIND = {
    **dict.fromkeys(("R_m", "k_t", "k_b"), 0.08),
    **dict.fromkeys(("L_a", "J_m", "J_g1", "J_s1", "J_p2", "J_g2", "J_cm", "J_cL"), 0.10),
    **dict.fromkeys(("bandwidth_hz", "b3_deg"), 0.10),
    **dict.fromkeys(("k_g1", "k_s1", "k_2", "k_3", "k_cm", "k_cL"), 0.15),
    **dict.fromkeys(("B_m", "T_f_m", "T_f_L", "B_L", "c_s1", "c_g1", "c_2", "c_3"), 0.30),
    **dict.fromkeys(("c_cm", "c_cL"), 0.30),
}
"""By kind: windings and magnets, inertias, stiffness, friction and damping. Gains and the load are
known better."""

_EXACT = ("filter_numerator", "N_1", "N", "N_3", "delay_s", "K_p", "T_i_s", "K_v", "computing_s")
"""Teeth are counted, the filter's gain is the tachometer's, a delay is so many samples, and a
controller's gains are set: no tolerance if not by name."""

_SCALES = ("k_ts", "filter_numerator")


def response_scales(unit: Any) -> tuple[str, ...]:
    """Values that scale the whole response of a unit and do nothing else.

    What a controller acts on decides its loop gain, too.
    """
    if unit.loop is None:
        return _SCALES
    return () if unit.loop.filtered else ("filter_numerator",)


_TOLERATED = (
    "L_a", "R_m", "k_b", "k_t", "J_m", "B_m", "T_f_m", "k_a", "k_ts", "filter_numerator",
    "N_1", "k_g1", "J_g1", "k_s1", "J_s1", "J_p2", "N", "k_2", "J_L", "T_f_L", "B_L", "c_s1",
    "c_g1", "c_2", "bandwidth_hz", "delay_s", "k_cm", "c_cm", "J_cm", "k_cL", "c_cL", "J_cL",
    "K_p", "T_i_s", "K_v", "computing_s", "low_pass_hz", "high_pass_hz", "J_g2", "N_3", "k_3",
    "c_3", "b3_deg",
)  # fmt: skip
"""Table 1 but for the total backlash, whose departure is the effect total-backlash; and what drives
have that are not the paper's."""


def believed_shares(
    parameters: Iterable[str], options: Mapping[str, float], file: Mapping[str, float]
) -> dict[str, tuple[float, str]]:
    """One standard deviation of each value that has one, as a share, and where it comes from.

    ``option``, ``unit file`` or ``default``. A name counts before ``default``, an option before
    the file, and what nobody gives is taken by the kind of the value.
    """
    found = {}
    for symbol in _tolerated(parameters):
        keys = (symbol,) if symbol in _EXACT else (symbol, DEFAULT)
        told = ((options, "option"), (file, "unit file"))
        given = [(shares[k], origin) for shares, origin in told for k in keys if k in shares]
        usual = 0.0 if symbol in _EXACT else _BY_KIND.get(symbol, USUAL)
        found[symbol] = (*given, (usual, "default"))[0]
    return found


def find_fault(parameters: Iterable[str], shares: Mapping[str, float]) -> str:
    """What is wrong with tolerances by symbol, in words; empty where nothing is."""
    known = (DEFAULT, *_tolerated(parameters))
    for symbol, share in shares.items():
        if symbol == "b_t_deg":
            return (
                "tolerance of b_t_deg: what the backlash is off by is estimated "
                "(--total-backlash-unknown) or diagnosed (total-backlash); leave it out"
            )
        if symbol not in known:
            return (
                f"tolerance of {symbol!r}: no value of that name has one; use one of: "
                f"{', '.join(known)}"
            )
        if not 0.0 <= share <= MOST:
            return (
                f"tolerance of {symbol}: {share:g} is outside 0 to {MOST:g}; give one standard "
                "deviation as a share (0.05) or in per cent (5%)"
            )
    return ""


def _tolerated(parameters: Iterable[str]) -> tuple[str, ...]:
    there = set(parameters)
    return tuple(symbol for symbol in _TOLERATED if symbol in there)
