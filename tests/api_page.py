"""The page of the public interface, made from what the packages name in ``__all__``.

A package's ``__all__`` names its public modules, a module's its public names.
``python tests/api_page.py`` writes docs/api.md; a test says when that is due.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from enum import Enum
from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "api.md"
FLOORS = ("daq", "sim", "analysis", "tui")

_HEAD = """\
# The interface

The interface for scripts: the modules in the `__all__` of each package, and the names in theirs.
They change only after a version that says so in the [CHANGELOG](../CHANGELOG.md). Results have
`.to_json()`, the document of their verb, and `.summary()`, lines of text. Units,
shapes and errors are in the docstrings (`python -m pydoc sim.response`). Examples:
[headless](examples/headless.py), [replay](examples/replay.py),
[own unit](examples/own_unit.py), [own effect](examples/own_effect.py),
[fleet](examples/fleet.py),
[notebook](examples/notebook.ipynb). `python tests/api_page.py` makes this page.
"""


_FIELDS = 6
"""Fields of a class that are listed; its docstring has all of them."""

_USUAL = ("to_json", "summary", "close", "model_post_init")
"""Methods that say what they do by their name, and one of pydantic's own."""


def page() -> str:
    """The whole page, from what can be imported."""
    return "\n".join([_HEAD, *(line for floor in FLOORS for line in _floor(floor))])


def public_modules(package: ModuleType) -> Iterator[ModuleType]:
    """The modules that a package names, packages among them gone through likewise."""
    for name in package.__all__:
        full = f"{package.__name__}.{name}"
        if hasattr(package, name) and not inspect.ismodule(getattr(package, name)):
            continue
        module = import_module(full)
        # What is not imported yet is a module, too.
        if any(inspect.ismodule(getattr(module, inner, module)) for inner in module.__all__):
            yield from public_modules(module)
        else:
            yield module


def _floor(name: str) -> Iterator[str]:
    package = import_module(name)
    yield f"## {name}\n"
    yield f"{_summary(package)}\n"
    for module in public_modules(package):
        yield f"### {module.__name__}\n"
        yield f"{_summary(module)}\n"
        for public in sorted(module.__all__, key=lambda n: (n.isupper(), n)):
            yield from _entry(public, getattr(module, public))
        yield ""


def _entry(name: str, thing: object) -> Iterator[str]:
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        yield f"- `{name}`"
        return
    if not inspect.isclass(thing):
        yield f"- `{name}{_parameters(thing)}`: {_summary(thing)}"
        return
    if issubclass(thing, Enum):
        members = ", ".join(f"`{member}`" for member in thing.__members__)
        yield f"- `{name}`: {_summary(thing)} {members}"
        return
    plain = issubclass(thing, Exception) or getattr(thing, "_is_protocol", False)
    yield f"- `{name}{'' if plain else _parameters(thing)}`: {_summary(thing)}"
    for member, value in sorted(_members(thing).items()):
        function = value.__func__ if isinstance(value, classmethod) else value
        if member.startswith("_") or member in _USUAL:
            continue
        if isinstance(value, property):
            yield f"  - `.{member}`: {_summary(value)}"
        elif inspect.isfunction(function):
            yield f"  - `.{member}{_parameters(function)}`: {_summary(function)}"


def _members(thing: type) -> dict[str, object]:
    """What a class has of its own; what a public base describes stands there alone."""
    bases = [base for base in thing.__mro__ if base.__module__.split(".")[0] in FLOORS]
    described = {name for base in bases[1:] if _is_public(base) for name in vars(base)}
    every = {name: value for base in reversed(bases) for name, value in vars(base).items()}
    return {name: value for name, value in every.items() if name not in described}


def _is_public(thing: type) -> bool:
    module = import_module(thing.__module__)
    return thing.__name__ in getattr(module, "__all__", ()) and not any(
        part.startswith("_") for part in thing.__module__.split(".")
    )


def _parameters(thing: object) -> str:
    """Names only: types and defaults stand in the docstrings."""
    try:
        signature = inspect.signature(thing)
    except ValueError:
        return ""
    bare = [
        p.replace(annotation=inspect.Parameter.empty, default=inspect.Parameter.empty)
        for p in signature.parameters.values()
        if p.name not in ("self", "cls")
    ]
    shown, starred = [], False
    for parameter in bare:
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            shown.append("*")
        starred |= parameter.kind in (parameter.KEYWORD_ONLY, parameter.VAR_POSITIONAL)
        shown.append(str(parameter))
    if inspect.isclass(thing) and len(shown) > _FIELDS:
        shown = [*shown[:_FIELDS], "..."]
    return f"({', '.join(shown)})"


def _summary(thing: object) -> str:
    return " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    PAGE.write_text(page(), encoding="utf-8")
