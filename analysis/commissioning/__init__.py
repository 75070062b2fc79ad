"""Commissioning: the parameters of one drive, identified from sweeps while it is known to be good.

Owns the way from responses to a unit file with values and covariance. It looks for no causes: what
a good drive cannot show is refused.
"""

from analysis.commissioning.commission import Commissioned, Parameter, commission_drive
from analysis.commissioning.unit_file import commissioned_unit_text

__all__ = ["Commissioned", "Parameter", "commission_drive", "commissioned_unit_text"]
