"""The tables of a bench's history as the queries name them.

Owns names and types of the columns, as `daq.store.schema` lays them out. It runs
nothing and reads no file.
"""

from __future__ import annotations

import json
from typing import Any

import sqlalchemy as sa

from daq.untrusted.bounded_text import parse_json

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


class JsonText(sa.TypeDecorator[Any]):
    """JSON as text, alike in every database: what is read is read within bounds."""

    impl = sa.Text
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: sa.Dialect) -> str:
        """To the text that is stored."""
        return json.dumps(value)

    def process_result_value(self, value: Any, dialect: sa.Dialect) -> Any:
        """From the text that was stored."""
        return None if value is None else parse_json(value)


units = sa.Table(
    "units",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("name", sa.Text),
    sa.Column("serial", sa.Text),
)
instruments = sa.Table(
    "instruments",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("maker", sa.Text),
    sa.Column("model", sa.Text),
    sa.Column("serial", sa.Text),
    sa.Column("revision", sa.Text),
    sa.Column("options", JsonText()),
    sa.Column("simulated", sa.Boolean),
)
plans = sa.Table(
    "plans",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("document", sa.Text),
    sa.Column("points", sa.BigInteger),
    sa.Column("levels", JsonText()),
)
measurements = sa.Table(
    "measurements",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("unit_id", sa.BigInteger),
    sa.Column("plan_id", sa.BigInteger),
    sa.Column("instrument_id", sa.BigInteger),
    sa.Column("address", sa.Text),
    sa.Column("state", sa.Text),
    sa.Column("source_state", sa.Text),
    sa.Column("started", sa.Text),
    sa.Column("ended", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("operator", sa.Text),
    sa.Column("notes", sa.Text),
    sa.Column("configurations", JsonText()),
    sa.Column("readback", JsonText()),
    sa.Column("points", sa.BigInteger),
    sa.Column("flagged", sa.BigInteger),
    sa.Column("points_version", sa.BigInteger),
)
points = sa.Table(
    "points",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger),
    sa.Column("source_vpk", sa.Double),
    sa.Column("requested_hz", sa.Double),
    sa.Column("frequency_hz", sa.Double),
    sa.Column("gain_re", sa.Double),
    sa.Column("gain_im", sa.Double),
    sa.Column("gain_std_db", sa.Double),
    sa.Column("phase_std_deg", sa.Double),
    sa.Column("variance_1", sa.Double),
    sa.Column("variance_2", sa.Double),
    sa.Column("flags", sa.BigInteger),
    sa.Column("detail", JsonText()),
    sa.Column("taken", sa.Text),
    sa.Column("superseded_by", sa.BigInteger),
)
events = sa.Table(
    "events",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger),
    sa.Column("time", sa.Text),
    sa.Column("kind", sa.Text),
    sa.Column("text", sa.Text),
    sa.Column("data", JsonText()),
)
estimates = sa.Table(
    "estimates",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger),
    sa.Column("made", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("document", JsonText()),
    sa.Column("points_version", sa.BigInteger),
    sa.Column("physics", sa.Text),
    sa.Column("edition", sa.Text),
    sa.Column("elapsed_s", sa.Double),
    sa.Column("summary", JsonText()),
)
diagnoses = sa.Table(
    "diagnoses",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger),
    sa.Column("made", sa.Text),
    sa.Column("software", sa.Text),
    sa.Column("document", JsonText()),
    sa.Column("physics", sa.Text),
    sa.Column("as_measured", sa.Boolean),
    sa.Column("edition", sa.Text),
    sa.Column("elapsed_s", sa.Double),
    sa.Column("summary", JsonText()),
)
diagnosed_points = sa.Table(
    "diagnosed_points",
    _metadata,
    sa.Column("diagnosis_id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger, primary_key=True),
    sa.Column("points_version", sa.BigInteger),
)
corrections = sa.Table(
    "corrections",
    _metadata,
    sa.Column("id", sa.BigInteger, primary_key=True),
    sa.Column("measurement_id", sa.BigInteger),
    sa.Column("time", sa.Text),
    sa.Column("person", sa.Text),
    sa.Column("field", sa.Text),
    sa.Column("old", sa.Text),
    sa.Column("new", sa.Text),
)
