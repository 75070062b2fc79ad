"""Every error that lashbench raises on purpose, and the exit code each one means.

    LashbenchError                 1  the operation failed
    ├── InputError                 2  usage, configuration or unreadable input
    │   ├── ConfigurationError     2  a unit, bench or recipe file is wrong
    │   └── FileFormatError        2  a data file cannot be read whole
    ├── AnalysisError              1  the data do not carry the answer
    ├── MeasurementError           1  the instrument refused or spoilt the measurement
    │   └── InstrumentError        1  the instrument reported an error of its own
    ├── LinkError                  3  no connection, or it was lost
    │   └── ProtocolError          3  bytes came, but not those that were due
    ├── BenchTimeout               4  a wait ran past its bound
    ├── LimitError                 5  refused by a limit of bench, unit or recipe
    └── Interrupted              130  ended on request before anything was driven

A message is one line: what, which value, what to do. This module imports
nothing and must never print.
"""

__all__ = [
    "AnalysisError",
    "BenchTimeout",
    "ConfigurationError",
    "FileFormatError",
    "InputError",
    "InstrumentError",
    "Interrupted",
    "LashbenchError",
    "LimitError",
    "LinkError",
    "MeasurementError",
    "ProtocolError",
]


class LashbenchError(Exception):
    """Base of all errors that carry a message meant for the operator."""

    exit_code = 1


class InputError(LashbenchError):
    """A command, option or file given by the user is not usable."""

    exit_code = 2


class ConfigurationError(InputError):
    """A unit, bench or recipe file is wrong; the message lists every fault with file and key."""


class FileFormatError(InputError):
    """A data file cannot be read whole; nothing of it was taken."""


class AnalysisError(LashbenchError):
    """The data do not carry the answer that was asked for."""


class MeasurementError(LashbenchError):
    """The measurement could not be made or finished."""


class InstrumentError(MeasurementError):
    """The instrument reported an error in its own queue."""


class LinkError(LashbenchError):
    """There is no connection to the instrument, or it was lost."""

    exit_code = 3


class ProtocolError(LinkError):
    """Bytes arrived, but not the ones the protocol calls for."""


class BenchTimeout(LashbenchError):
    """A bounded wait ran out; the message names the command that waited."""

    exit_code = 4


class LimitError(LashbenchError):
    """A limit of bench, unit or recipe forbids the request; no byte was sent."""

    exit_code = 5


class Interrupted(LashbenchError):
    """An end was asked for before anything was driven."""

    exit_code = 130
