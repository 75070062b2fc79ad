"""Datasheet values before anything is simulated: catalogue units, plausibility, the chain in words.

Owns what a person who fills in a unit file is told. It simulates no motion.
"""

from sim.datasheet.catalogue_units import (
    SENSOR_GAINS,
    CatalogueUnit,
    parse_quantity,
    shown_symbol,
    units_of,
)
from sim.datasheet.chain import describe_chain, natural_frequencies
from sim.datasheet.plausibility import (
    find_impossible,
    find_unusual,
    impossible_among,
    unusual_among,
)

__all__ = [
    "SENSOR_GAINS",
    "CatalogueUnit",
    "describe_chain",
    "find_impossible",
    "find_unusual",
    "impossible_among",
    "natural_frequencies",
    "parse_quantity",
    "shown_symbol",
    "units_of",
    "unusual_among",
]
