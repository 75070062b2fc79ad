"""``lashbench new-unit``: a commented unit file to fill in.

Owns the options of the verb and that nothing is overwritten. The files are
templates that come with lashbench.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from daq.errors import InputError
from tui.text.output import Injected

__all__ = ["new_unit"]

_TEMPLATES = {1: "one-stage", 2: "two-stage"}


def new_unit(
    *,
    out: Path,
    name: str | None = None,
    stages: Literal[1, 2] = 2,
    console: Injected,
) -> None:
    """Write a unit file with example numbers and what each of them means.

    Parameters
    ----------
    out
        TOML file to write; one that exists is left alone.
    name
        Name of the unit; that of the file if left out.
    stages
        Gear stages between motor and load.
    """
    import json
    import shlex

    from daq.configs import config_path
    from daq.formats.atomic import checked_target, write_text
    from sim.unit import load_unit

    title = out.stem.upper() if name is None else name
    if not title.strip() or len(title) > 64 or not title.isprintable():
        raise InputError(f"unit name {title!r}: give 1 to 64 characters on one line")
    if checked_target(out).exists():
        raise InputError(f"{out}: is there already and is left as it is; give another name")
    template = config_path("templates", _TEMPLATES[stages]).read_text(encoding="utf-8")
    heading, rest = template.split("\n", 1)
    shown = shlex.quote(str(out)) if str(out).isprintable() else "FILE"
    quoted = json.dumps(title, ensure_ascii=False)
    rest = rest.replace('name = "NAME"', f"name = {quoted}", 1).replace("FILE", shown, 1)
    write_text(out, f"{heading.replace('NAME', title, 1)}\n{rest}")
    load_unit(str(out))
    console.note(f"wrote {out}; every number in it is an example: put in those of your drive")
