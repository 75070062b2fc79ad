"""The tables of a bench's history as the queries name them.

Owns names and types of the columns, as `daq.store.schema` lays them out. It runs
nothing and reads no file.
"""

from __future__ import annotations

import sqlalchemy as sa

__all__ = [
    "corrections",
    "diagnosed_points",
    "diagnoses",
    "estimates",
    "events",
    "instruments",
    "measurements",
    "plans",
    "points",
    "units",
]

_metadata = sa.MetaData()

units = sa.Table(
    "units",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("name", sa.Text),
    sa.Column("serial", sa.Text),
)
instruments = sa.Table(
    "instruments",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("maker", sa.Text),
    sa.Column("model", sa.Text),
    sa.Column("serial", sa.Text),
    sa.Column("revision", sa.Text),
    sa.Column("options", sa.JSON),
    sa.Column("simulated", sa.Boolean),
)
plans = sa.Table(
    "plans",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("document", sa.Text),
    sa.Column("points", sa.Integer),
    sa.Column("levels", sa.JSON),
)
measurements = sa.Table(
    "measurements",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("unit_id", sa.Integer),
    sa.Column("plan_id", sa.Integer),
    sa.Column("instrument_id", sa.Integer),
    sa.Column("address", sa.Text),
    sa.Column("state", sa.Text),
    sa.Column("source_state", sa.Text),
    sa.Column("started", sa.Text),
    sa.Column("ended", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("operator", sa.Text),
    sa.Column("notes", sa.Text),
    sa.Column("configurations", sa.JSON),
    sa.Column("readback", sa.JSON),
    sa.Column("points", sa.Integer),
    sa.Column("flagged", sa.Integer),
    sa.Column("points_version", sa.Integer),
)
points = sa.Table(
    "points",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("source_vpk", sa.REAL),
    sa.Column("requested_hz", sa.REAL),
    sa.Column("frequency_hz", sa.REAL),
    sa.Column("gain_re", sa.REAL),
    sa.Column("gain_im", sa.REAL),
    sa.Column("gain_std_db", sa.REAL),
    sa.Column("phase_std_deg", sa.REAL),
    sa.Column("variance_1", sa.REAL),
    sa.Column("variance_2", sa.REAL),
    sa.Column("flags", sa.Integer),
    sa.Column("detail", sa.JSON),
    sa.Column("taken", sa.Text),
    sa.Column("superseded_by", sa.Integer),
)
events = sa.Table(
    "events",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("time", sa.Text),
    sa.Column("kind", sa.Text),
    sa.Column("text", sa.Text),
    sa.Column("data", sa.JSON),
)
estimates = sa.Table(
    "estimates",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("made", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("document", sa.JSON),
    sa.Column("points_version", sa.Integer),
    sa.Column("physics", sa.Text),
    sa.Column("edition", sa.Text),
    sa.Column("elapsed_s", sa.REAL),
    sa.Column("summary", sa.JSON),
)
diagnoses = sa.Table(
    "diagnoses",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("made", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("document", sa.JSON),
    sa.Column("physics", sa.Text),
    sa.Column("as_measured", sa.Boolean),
    sa.Column("edition", sa.Text),
    sa.Column("elapsed_s", sa.REAL),
    sa.Column("summary", sa.JSON),
)
diagnosed_points = sa.Table(
    "diagnosed_points",
    _metadata,
    sa.Column("diagnosis_id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer, primary_key=True),
    sa.Column("points_version", sa.Integer),
)
corrections = sa.Table(
    "corrections",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("measurement_id", sa.Integer),
    sa.Column("time", sa.Text),
    sa.Column("person", sa.Text),
    sa.Column("field", sa.Text),
    sa.Column("old", sa.Text),
    sa.Column("new", sa.Text),
)
