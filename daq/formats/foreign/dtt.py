"""Transfer functions that LIGO's diaggui (DTT) saved: LIGO light-weight XML with base64 arrays.

Owns that layout. Each channel B over channel A is a function, its coherence another; which one is
taken is `choosing`'s part. `daq.formats` calls `read` in a child process, since an XML file may be
made to fill the memory.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.choosing import foreign_response
from daq.formats.foreign.functions import COHERENCE, RESPONSE, Axis, Function
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.formats.record import checked_file
from daq.frf import FrequencyResponse

__all__ = ["read"]

_KIND = "a transfer function that diaggui saved as XML"
_LIMIT_BYTES = 256 << 20
_SUBTYPES = {0: (RESPONSE, False), 2: (COHERENCE, False), 3: (RESPONSE, True), 5: (COHERENCE, True)}
"""Subtypes of a result: what it is, and whether its frequencies are listed."""
_MOST = 4_000_000


def read(path: Path, reading: Reading = NOTHING_TOLD) -> FrequencyResponse:
    """Read one transfer function.

    Raises
    ------
    FileFormatError
        If the file is no such XML, is damaged, or holds none or several that nothing tells apart.
    InputError
        If `reading` says something that this file has no use for.
    """
    reading.refuse_unused(path, ("function", "averages", "columns"), "an XML file of diaggui")
    content = checked_file(path, _KIND).read_bytes()
    if len(content) > _LIMIT_BYTES:
        raise FileFormatError(
            f"{path}: has {len(content)} bytes, more than any result; give {_KIND}"
        )
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise FileFormatError(f"{path}: is not whole XML ({error}); give {_KIND}") from error
    if root.tag != "LIGO_LW":
        raise FileFormatError(f"{path}: is XML of {root.tag[:40]!r}; give {_KIND}")
    functions: list[Function] = []
    averages: set[int] = set()
    for node in root.iter("LIGO_LW"):
        if node.get("Type") == "TransferFunction":
            found, count = _functions(node, len(functions), path)
            functions += found
            averages |= {count} if count else set()
    if reading.averages is None and len(averages) == 1:
        has_coherence = any(one.kind == COHERENCE for one in functions)
        reading = replace(reading, averages=averages.pop() if has_coherence else None)
    return foreign_response(functions, reading, path)


def _functions(
    node: ElementTree.Element, before: int, path: Path
) -> tuple[list[Function], int | None]:
    """The functions of one result, and its averages."""
    said = {item.get("Name", ""): (item.text or "").strip() for item in node.findall("Param")}
    name = node.get("Name", "")[:40]
    place = f"{path}: {name}"
    kind, listed = _SUBTYPES.get(_whole(said, "Subtype", place), (0, False))
    if not kind:
        return [], None
    points, several = _whole(said, "N", place), _whole(said, "M", place)
    if not (0 < points <= _MOST and 0 < several <= 1000 and points * several <= _MOST):
        raise FileFormatError(f"{place} states {points} points of {several} channels")
    values = _stream(node, "<c8" if kind == RESPONSE else "<f4", place)
    needed = points * (several + listed)
    if len(values) != needed:
        raise FileFormatError(f"{place} should have {needed} numbers, found {len(values)}")
    if listed:
        hertz, values = np.real(values[:points]).astype(float), values[points:]
    else:
        grid = _real(said, "f0", place) + _real(said, "df", place) * np.arange(points)
        hertz = np.asarray(grid, dtype=float)
    if not (np.all(np.isfinite(values)) and np.all(np.isfinite(hertz))):
        raise FileFormatError(f"{place} holds a number that is none")
    below = said.get("ChannelA", "") or "A"
    tops = [said.get(f"ChannelB[{k}]", "") or f"B[{k}]" for k in range(several)]
    # A channel over itself, which diaggui keeps, too, says nothing.
    channels = zip(tops, values.reshape(several, points), strict=True)
    pairs = [(top, row) for top, row in channels if top != below]
    found = [
        Function(
            number=before + k,
            kind=kind,
            titles=(name,),
            response=top,
            reference=below,
            names=("", ""),
            abscissa=Axis(18, "", "Hz"),
            ordinate=Axis(0, "", "" if kind == RESPONSE else "coherence"),
            denominator=Axis(),
            third=Axis(),
            third_value=0.0,
            x=hertz,
            values=row.astype(complex) if kind == RESPONSE else row.astype(float),
        )
        for k, (top, row) in enumerate(pairs, start=1)
    ]
    return found, _whole(said, "Averages", place) if "Averages" in said else None


def _stream(node: ElementTree.Element, dtype: str, place: str) -> NDArray[Any]:
    streams = list(_streams(node))
    if len(streams) != 1:
        raise FileFormatError(f"{place} holds {len(streams)} arrays where one is due")
    encoding = streams[0].get("Encoding", "").replace(" ", "").lower()
    order = {"littleendian,base64": "<", "bigendian,base64": ">"}.get(encoding)
    if order is None:
        raise FileFormatError(f"{place}: its array is encoded as {encoding[:40]!r}; save as base64")
    try:
        content = base64.b64decode(re.sub(r"\s+", "", streams[0].text or ""), validate=True)
        return np.frombuffer(content, dtype.replace("<", order))
    except (binascii.Error, ValueError) as error:
        raise FileFormatError(f"{place}: its array is damaged ({error})") from error


def _streams(node: ElementTree.Element) -> Iterator[ElementTree.Element]:
    for array in node.findall("Array"):
        yield from array.findall("Stream")


def _whole(said: dict[str, str], name: str, place: str) -> int:
    text = said.get(name, "")
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise FileFormatError(f"{place}: {name} {text[:20]!r} is not a whole number")
    return int(text)


def _real(said: dict[str, str], name: str, place: str) -> float:
    text = said.get(name, "")
    if not re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]{1,3})?", text, re.IGNORECASE):
        raise FileFormatError(f"{place}: {name} {text[:20]!r} is not a number")
    return float(text)
