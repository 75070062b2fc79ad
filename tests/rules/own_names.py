"""Where tests patch our own functions or read our private names, found in their source.

Owns the rule: what tests may replace is the world around the program (environment variables, the
system, libraries), never a part of it. It runs no test.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

FLOORS = ("daq", "sim", "analysis", "tui", "lashbench")
FOREIGN = {"_compositor", "_dash_pattern", "_exit", "_fields", "_repr_html_", "_replace"}
"""Private or underlined names of libraries, where nothing public does."""


def _root(node: ast.AST) -> str:
    """The first name of an expression, or of the path that a text begins with."""
    while isinstance(node, ast.Attribute | ast.Call):
        node = node.value if isinstance(node, ast.Attribute) else node.func
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.JoinedStr) and node.values:
        node = node.values[0]
    return str(node.value).split(".")[0] if isinstance(node, ast.Constant) else ""


def _imported(tree: ast.AST) -> dict[str, bool]:
    """Whether each imported name is ours."""
    known = dict.fromkeys(FLOORS, True)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                known[name.asname or name.name.split(".")[0]] = name.name.split(".")[0] in FLOORS
        elif isinstance(node, ast.ImportFrom):
            ours = (node.module or "").split(".")[0] in FLOORS
            known |= {name.asname or name.name: ours for name in node.names}
    return known


def patches(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each replacement of a part of the program.

    ``monkeypatch.setattr`` and its like on a module, a class or a function of ours, by name or by
    its path. What a path in a variable names counts as ours.
    """
    tree = ast.parse(source)
    known = _imported(tree)
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args):
            continue
        if node.func.attr in ("setattr", "delattr", "patch", "object"):
            owner = node.func.value
            if node.func.attr == "object" and _root(owner) not in ("mock", "patch"):
                continue
            text = isinstance(node.args[0], ast.Constant | ast.JoinedStr)
            if known.get(_root(node.args[0]), text and not _root(node.args[0])):
                yield node.lineno, ast.unparse(node)[:100]


def private_names(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each look at a private name of something that is not the test's own."""
    tree = ast.parse(source)
    own = {node.attr for node in ast.walk(tree) if _is_set_here(node)}
    own |= {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in FLOORS:
            for name in node.names:
                if name.name.startswith("_"):
                    yield node.lineno, f"{node.module}.{name.name}"
        elif (
            isinstance(node, ast.Attribute)
            and _is_private(node.attr)
            and node.attr not in FOREIGN | own
            and _root(node) not in ("self", "cls", "super")
        ):
            yield node.lineno, ast.unparse(node)


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def _is_set_here(node: ast.AST) -> bool:
    """Whether a class of the file itself gives itself this attribute."""
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and _is_private(node.attr)
        and _root(node) == "self"
    )


def found_in(folder: Path, look) -> list[str]:
    """Everything that `look` finds in the Python files of a folder, with its place."""
    return [
        f"{path.relative_to(folder)}:{line}: {text}"
        for path in sorted(folder.rglob("*.py"))
        for line, text in look(path.read_text(encoding="utf-8"))
    ]


if __name__ == "__main__":
    for look in (patches, private_names):
        found = found_in(Path(__file__).parents[1], look)
        print("\n".join(found), len(found), sep="\n")  # noqa: T201
