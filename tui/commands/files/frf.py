"""``lashbench frf``: a frequency response from a record over time.

Owns the options of the verb. How records are read and responses estimated is `daq.time_records`'
and `analysis.time_records`'.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from daq.errors import InputError
from tui.options import Whole
from tui.reading_options import level_vpk
from tui.text.output import Injected

__all__ = ["frf"]


def frf(
    file: Path,
    /,
    *,
    out: Path,
    input_column: Annotated[str, Parameter(name="--input")],
    output_column: Annotated[str, Parameter(name="--output")],
    rate: float | None = None,
    time: str | None = None,
    excitation: Literal["stepped", "sweep", "periodic", "noise"] | None = None,
    estimator: Literal["H1", "H2", "Hv"] = "H1",
    resolution: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    settle_cycles: Whole | None = None,
    integrate_cycles: Whole | None = None,
    input_scale: float = 1.0,
    output_scale: float = 1.0,
    level: str | None = None,
    unit_name: str = "unknown",
    console: Injected,
) -> None:
    """Estimate the response of a servo from a record of its input and output over time.

    The input may be a stepped sine (one point for each dwell and level), a sweep (chirp), a
    periodic signal such as a multisine, or noise; that is found out and written to the file.

    Parameters
    ----------
    file
        Record as CSV or other text, WAV (volts by the scales), MATLAB, or TDMS.
    out
        File to write: csv, h5, uff or mat by its suffix.
    input_column
        Column, channel or variable that drives the servo: a name, or a number from 1.
    output_column
        The one that the servo answers with.
    rate
        Sampling rate, Hz, of a file that does not say it.
    time
        Column of times in s, in place of the rate.
    excitation
        What the input is, if it is not to be found out.
    estimator
        For noise: H1 (noise at the output), H2 (at the input) or Hv (at both).
    resolution
        Step of frequencies for noise and sweeps, Hz.
    start
        Lowest frequency to write, Hz.
    stop
        Highest frequency to write, Hz.
    settle_cycles
        Of each dwell of a stepped sine, cycles that are left out; half of them if not given.
    integrate_cycles
        Of each dwell of a stepped sine, cycles that are used; all others if not given.
    input_scale
        Volts for each unit of the input column.
    output_scale
        Volts for each unit of the output column.
    level
        Source level in V peak (or 1Vrms, 3Vpp) to write in place of what the record shows.
    unit_name
        Name of the unit under test.
    """
    from analysis.time_records.response import response_of_record
    from daq.formats import check_writable, write_response
    from daq.time_records.columns import read_record

    check_writable(out, file)
    if rate is not None and not (math.isfinite(rate) and rate > 0.0):
        raise InputError(f"--rate {rate:g} Hz is no sampling rate; give samples per second")
    for name, value in (("--resolution", resolution), ("--start", start), ("--stop", stop)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name} {value:g} is no frequency; give one above 0 Hz")
    if start is not None and stop is not None and not start < stop:
        raise InputError(f"--start {start:g} Hz is not below --stop {stop:g} Hz")
    for name, value in (("--input-scale", input_scale), ("--output-scale", output_scale)):
        if not math.isfinite(value) or value == 0.0:
            raise InputError(f"{name} {value:g} is no scale; give volts per unit of the column")
    for name, count, least in (
        ("--settle-cycles", settle_cycles, 0),
        ("--integrate-cycles", integrate_cycles, 3),
    ):
        if count is not None and count < least:
            raise InputError(f"{name} {count} is not a whole number of {least} or more")
    if not unit_name.strip():
        raise InputError("--unit-name is empty; give a name, or leave it out")
    record = read_record(file, input_column, output_column, rate_hz=rate, time_column=time).scaled(
        input_scale, output_scale
    )
    response, notes = response_of_record(
        record,
        unit=unit_name,
        excitation=excitation,
        estimator=estimator,
        resolution_hz=resolution,
        start_hz=start or 0.0,
        stop_hz=stop or math.inf,
        level_vpk=None if level is None else level_vpk(level),
        settle_cycles=settle_cycles,
        integrate_cycles=integrate_cycles,
    )
    console.note(f"{file}: {record.duration_s:.6g} s at {record.rate_hz:.6g} Hz")
    for note in notes:
        console.note(note)
    write_response(response, out)
    console.note(
        f"wrote {len(response)} points from {response.frequency_hz.min():.4g} to "
        f"{response.frequency_hz.max():.4g} Hz to {out}"
    )
