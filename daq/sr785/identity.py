"""Who answers: finding the interface that replies go to, reading ``*IDN?``, refusing others.

Owns the forms of the identity. It changes nothing in the instrument but ``OUTX``.
"""

from __future__ import annotations

from contextlib import suppress

from daq.analyser import Identity
from daq.drivers import stranger
from daq.errors import BenchTimeout, InstrumentError, LashbenchError, ProtocolError
from daq.sr785.dialogue import GPIB, RS232, Dialogue
from daq.sr785.settings import MODELS

__all__ = ["identify", "parse_identity"]

_MAKER = "STANFORD"
_SIMULATED = "SIM"
"""A simulated analyser has this in its serial number."""


def parse_identity(identity: str) -> Identity:
    """The record behind an answer to ``*IDN?``.

    Raises
    ------
    InstrumentError
        If it is neither an SR785 nor an SR780.
    """
    fields = [field.strip() for field in identity.split(",")]
    if len(fields) != 4 or fields[1].upper() not in MODELS:
        raise InstrumentError(
            f"{identity!r} answers '*IDN?', an SR785 or SR780 was due; "
            f"{stranger(identity, 'sr785')}"
        )
    if not fields[0].upper().startswith(_MAKER):
        raise InstrumentError(
            f"{identity!r} answers '*IDN?' with a maker that never made one; check the address"
        )
    maker, model, serial, revision = fields
    simulated = _SIMULATED in serial.upper()
    return Identity(maker.replace("_", " "), model.upper(), serial, revision, (), simulated)


def identify(dialogue: Dialogue) -> Identity:
    """Clear the instrument, let it reply here, and ask who it is.

    A bare stream may end at either interface, so both are tried there.

    Raises
    ------
    InstrumentError
        If it is neither an SR785 nor an SR780.
    """
    first = dialogue.interface
    try:
        dialogue.recover()
    except (BenchTimeout, ProtocolError) as error:
        dialogue.interface = RS232 if first == GPIB else GPIB
        try:
            dialogue.recover()
        except LashbenchError:
            dialogue.interface = first
            with suppress(LashbenchError):
                dialogue.recover()
            raise error from None
    return parse_identity(dialogue.ask("*IDN?"))
