"""Who answers: reading ``*IDN?`` and ``*OPT?``, and refusing what cannot sweep a sine.

Owns the forms in which makers have printed the identity. It changes nothing
in the instrument.
"""

from __future__ import annotations

from contextlib import suppress

from daq.analyser import Identity
from daq.drivers import driver_for, stranger
from daq.driving.replies import parse_string
from daq.driving.scpi_connection import Dialogue
from daq.errors import BenchTimeout, InstrumentError, ProtocolError
from daq.transports.base import ask

__all__ = ["identify", "parse_identity"]

_MODEL = "35670A"
_MAKERS = ("HP", "HEWLETT", "AGILENT", "KEYSIGHT")
_SWEPT_SINE = "1D2"
_SIMULATED = "SIM"
"""A simulated analyser has this in its serial number."""


def parse_identity(identity: str, options: str) -> Identity:
    """The record behind the answers to ``*IDN?`` and ``*OPT?``.

    The maker, and whether a comma parts serial number from revision, have
    changed over the years; the model field has not.

    Raises
    ------
    InstrumentError
        If it is no 35670A.
    """
    fields = [field.strip() for field in identity.split(",")]
    maker, model = (fields + ["", ""])[:2]
    if len(fields) not in (3, 4) or not model.upper().endswith(_MODEL):
        raise InstrumentError(
            f"{identity!r} answers '*IDN?', a {_MODEL} was due; {stranger(identity, '')}"
        )
    if not maker.upper().startswith(_MAKERS):
        raise InstrumentError(
            f"{identity!r} answers '*IDN?' with a maker that never made a {_MODEL}; "
            "check the address"
        )
    serial, revision = fields[2], fields[3] if len(fields) == 4 else ""
    listed = tuple(option.strip() for option in parse_string(options).split(",") if option.strip())
    return Identity(maker, _MODEL, serial, revision, listed, _SIMULATED in serial.upper())


def identify(dialogue: Dialogue) -> Identity:
    """Clear the instrument, ask who it is, and check that it can do the job.

    Raises
    ------
    InstrumentError
        If it is no 35670A, or lacks swept sine; said now and not in mid-run.
    """
    try:
        dialogue.recover()
    except (BenchTimeout, ProtocolError):
        _refuse_stranger(dialogue)
        raise
    identity = parse_identity(dialogue.ask("*IDN?"), dialogue.ask("*OPT?"))
    if _SWEPT_SINE not in identity.options:
        listed = ", ".join(identity.options) or "none"
        raise InstrumentError(
            f"{_MODEL} {identity.serial} has options {listed}; swept sine needs {_SWEPT_SINE}, "
            "use an analyser that has it"
        )
    return identity


def _refuse_stranger(dialogue: Dialogue) -> None:
    """An instrument of another language answers no question but who it is."""
    with suppress(BenchTimeout, ProtocolError):
        identity = ask(dialogue.transport, "*IDN?", dialogue.soon())
        if driver_for(identity) is not None:
            parse_identity(identity, "")
