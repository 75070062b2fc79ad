"""What a drive has besides voltage amplifier and tachometer: asked for, put into a template.

Owns the questions for the sections of ``parts.toml`` and how these go into the text of a unit
file. Values are asked for by `tui.unit_questions`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection

from daq.errors import InputError

__all__ = ["ask_parts", "commented", "with_parts"]

Say = Callable[[str], None]
Read = Callable[[], str]

_PARTS = (
    ("amplifier", "the amplifier controls the current, not the voltage"),
    ("sensor", "an encoder is read, not a tachometer"),
    ("accelerometer", "an accelerometer is read"),
    ("motor_current", "the motor's current is read"),
    ("sampling", "a digital controller holds the command from sample to sample"),
    ("motor_coupling", "an elastic coupling behind the motor"),
    ("load_coupling", "an elastic coupling before the load"),
    ("damping", "known damping of shaft or load"),
    ("efficiency", "a worm, harmonic or planetary stage of known efficiency"),
    ("loop", "a speed or position loop stays closed while it is measured"),
)
_OF_LOOP = (
    ("position", "a position loop is around the speed loop"),
    ("command", "the source is added behind the controller, not as its reference"),
)
_FIRST = "another sensor, controller, torque drive, coupling, damping or loop"
_IN_PLACE = ("accelerometer", "motor_current")
"""Sections that are one of ``[sensor]`` in place of the encoder's, each beginning with its gain."""
_OF_VOLTAGE = ("L_a", "R_m", "k_b")
_OF_FILTER = ("filter_numerator", "filter_denominator")


def ask_parts(say: Say, read: Read) -> tuple[str, ...]:
    """Names of the sections that a drive needs; one question where it needs none.

    After a loop what it is, ``position`` or ``command``, where it is so.

    Raises
    ------
    InputError
        If the input ends before the last answer.
    """
    if not _yes(say, read, _FIRST):
        return ()
    found: list[str] = []
    for name, words in _PARTS:
        useless = name in _IN_PLACE and any(one in found for one in ("sensor", *_IN_PLACE))
        useless = useless or (name == "motor_current" and "amplifier" in found)
        # A loop controls what its sensor reads, a speed or position.
        useless = useless or (name == "loop" and any(one in found for one in _IN_PLACE))
        if not useless and _yes(say, read, words):
            found.append(name)
    if "loop" in found:
        # A tachometer reads no position.
        asked = _OF_LOOP if "sensor" in found else _OF_LOOP[1:]
        found += [name for name, words in asked if _yes(say, read, words)]
    return tuple(found)


def with_parts(template: str, parts: str, names: Collection[str]) -> str:
    """A template with sections of `parts` before its limits, without what they make useless."""
    wanted = set(names)
    sections = dict(_sections(parts))
    if "sensor" in wanted and "sampling" not in wanted:
        # An encoder has a clock all the same, and so has a controller that acts on it.
        if "loop" not in wanted:
            sections["sampling"] = sections["sampling"].replace(
                "holds_command = true ", "holds_command = false"
            )
        wanted.add("sampling")
    if {"loop", "sensor"} <= wanted:
        # What is late inside the loop is the controller's.
        sections["sensor"] = re.sub(r"(?m)^delay_s.*\n", "", sections["sensor"])
        sections["loop"] = sections["loop"].replace(
            "# computing_s = 0.0005  ", "computing_s = 0.0005    "
        )
    if "position" in wanted:
        sections["sensor"] = sections["sensor"].replace('reads = "speed"   ', 'reads = "position"')
        loop = sections["loop"].replace('controls = "speed"   ', 'controls = "position"')
        sections["loop"] = loop.replace("# K_v = 30.0  ", "K_v = 30.0    ")
    if "command" in wanted:
        sections["loop"] = sections["loop"].replace('"reference"  ', '"command"    ')
    if "efficiency" in wanted:
        template = re.sub(r"(?m)^# (eta_[123] = \S+)", r"\1  ", template)
    useless: tuple[str, ...] = ()
    if "amplifier" in wanted:
        useless += _OF_VOLTAGE
        template = template.replace(
            "V at the motor per V at the amplifier's input", "A per V at the amplifier's input"
        )
    for name in wanted.intersection(_IN_PLACE):
        useless += _OF_FILTER
        head, gain, rest = sections[name].split("\n", 2)
        template = re.sub(r"(?m)^k_ts = .*$", gain, template)
        sections[name] = f"{head.replace(name, 'sensor', 1)}\n{rest}"
    if "sensor" in wanted:
        useless += _OF_FILTER
        template = template.replace("tachometer gain;", "of the record, 1 where it is in rad/s;")
    lines = [line for line in template.splitlines() if line.split(" ", 1)[0] not in useless]
    text = "\n".join(lines) + "\n"
    chosen = "".join(sections[name] for name in sections if name in wanted)
    return text.replace("[limits]", f"{chosen}[limits]", 1)


def commented(template: str, parts: str) -> str:
    """A template with all the sections at its end, as comments."""
    told = "".join(text for name, text in _sections(parts) if name not in _IN_PLACE)
    lines = "\n".join(f"# {line}".rstrip() for line in told.strip().splitlines())
    head = "# What a drive may have besides; take the signs # away from a section that yours has:"
    return f"{template.rstrip()}\n\n{head}\n\n{lines}\n"


def _sections(parts: str) -> list[tuple[str, str]]:
    """Names and texts of sections, each with a blank line at its end."""
    texts = re.split(r"(?m)^(?=\[)", parts.strip() + "\n")
    return [(text[1 : text.index("]")], text.rstrip() + "\n\n") for text in texts if text]


def _yes(say: Say, read: Read, words: str) -> bool:
    while True:
        say(f"{words} [yes / no]: ")
        line = read()
        if not line:
            say("\n")
            raise InputError("the input ended before the last answer; nothing was written")
        answer = line.strip().lower()
        if answer in ("yes", "y", "no", "n", "-"):
            return answer.startswith("y")
        say(f"{line.strip()!r} is neither yes nor no\n")
