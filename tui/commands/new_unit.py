"""``lashbench new-unit``: a commented unit file to fill in, filled in by questions, or checked.

Owns the options of the verb and that nothing is overwritten. The files are
templates that come with lashbench.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

from daq.errors import ConfigurationError, InputError
from tui.text.output import Console, Injected
from tui.text.shell_quote import pasted
from tui.unit_under_test import unit_title

__all__ = ["new_unit"]

_TEMPLATES = {1: "one-stage", 2: "two-stage", 3: "three-stage"}
_PARTS = "parts"


def new_unit(
    *,
    out: Path | None = None,
    name: str | None = None,
    stages: Literal[1, 2, 3] | None = None,
    ask: bool = False,
    check: Path | None = None,
    console: Injected,
) -> None:
    """Write a unit file with example numbers and what each of them means, or check one.

    Parameters
    ----------
    out
        TOML file to write; one that exists is left alone.
    name
        Name of the unit; that of the file if left out.
    stages
        Gear stages between motor and load; 2 if left out.
    ask
        Ask for each value at the terminal, in units of catalogues, and convert it.
    check
        Unit file to describe instead: chain, inertias, linear resonances and warnings.
    """
    if check is not None:
        if out is not None or name is not None or stages is not None or ask:
            raise InputError(f"--check {check} writes nothing; leave out the other options")
        _describe(check, console)
        return
    if out is None:
        raise InputError("nothing to do; give --out FILE to write or --check FILE to look at")
    from daq.formats.atomic import new_target, write_text

    title = unit_title(out, name)
    new_target(out)
    text = _asked(stages, console) if ask else _blank(2 if stages is None else stages)
    write_text(out, _named(text, title, out))
    _tell_of(out, ask, console)


def _template(stages: int) -> str:
    return _read_template(_TEMPLATES[stages])


def _blank(stages: int) -> str:
    from tui.units import commented

    return commented(_template(stages), _read_template(_PARTS))


def _read_template(name: str) -> str:
    from daq.configs import config_path

    return config_path("templates", name).read_text(encoding="utf-8")


def _named(text: str, title: str, out: Path) -> str:
    """The text of a template with the unit's name, and the file's in its commands."""
    import json

    heading, rest = text.split("\n", 1)
    shown = pasted([str(out)]) if str(out).isprintable() else "FILE"
    quoted = json.dumps(title, ensure_ascii=False)
    rest = rest.replace('name = "NAME"', f"name = {quoted}", 1).replace("FILE", shown, 1)
    return f"{heading.replace('NAME', title, 1)}\n{rest}"


def _asked(stages: int | None, console: Console) -> str:
    from tui.unit_questions import HELP, ask_for_values, ask_stages
    from tui.units import ask_parts, with_parts

    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise InputError("--ask needs a terminal; leave it out and edit the file that is written")
    console.prompt(HELP)
    count = ask_stages(console.prompt, _read_line) if stages is None else stages
    names = ask_parts(console.prompt, _read_line)
    template = with_parts(_template(count), _read_template(_PARTS), names)
    text = ask_for_values(template, console.prompt, _read_line)
    return text.replace("EVERY NUMBER BELOW IS AN EXAMPLE. Put in", "EVERY NUMBER BELOW IS AN "
                        "EXAMPLE where it was not given. Put in", 1)  # fmt: skip


def _read_line() -> str:
    # Whatever a terminal sends: a sign that is no UTF-8 is an answer to ask for again.
    return sys.stdin.buffer.readline().decode("utf-8", "replace")


def _tell_of(out: Path, asked: bool, console: Console) -> None:
    from sim.datasheet import find_unusual
    from sim.unit import load_unit

    try:
        unit = load_unit(str(out))
    except ConfigurationError as error:
        raise ConfigurationError(f"wrote {out}, to be corrected in an editor: {error}") from error
    for text in find_unusual(unit):
        console.note(f"warning: {text}")
    if asked:
        words = pasted(["lashbench", "new-unit", "--check", str(out)])
        console.note(f"wrote {out}; what follows from it: {words}")
        return
    console.note(f"wrote {out}; every number in it is an example: put in those of your drive")


def _describe(path: Path, console: Console) -> None:
    from sim.catalogue import CATALOGUE
    from sim.datasheet import describe_chain, find_unusual
    from sim.own_effects.trial import try_own_effects
    from sim.unit import load_unit

    unit = load_unit(str(path))
    own = [f"own effect {name}: {CATALOGUE[name].meaning}" for name in try_own_effects(unit)]
    warnings = [f"warning: {text}" for text in find_unusual(unit)]
    lines = [f"unit {unit.name}", *describe_chain(unit), *own, *(warnings or ["no warnings"])]
    console.data("\n".join(lines))
