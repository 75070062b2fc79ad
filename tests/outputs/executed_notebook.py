"""The executed notebook of the documentation, made from the script of the same name.

Owns how parts of the script become cells: a line ``# %% Words.`` begins one, its words stand above
it. ``make notebook`` installs nbclient, runs every cell and writes docs/examples/notebook.ipynb.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
SCRIPT, NOTEBOOK = EXAMPLES / "notebook.py", EXAMPLES / "notebook.ipynb"
MOST_BYTES = 300_000

_PART = re.compile(r"^# %% (.+)\n", re.MULTILINE)
_PATIENCE_S = 3600

_BEFORE = """
%matplotlib inline
%config InlineBackend.print_figure_kwargs = {"dpi": 55}
import os
os.environ["COLUMNS"] = "80"
"""
"""Run before the first cell, and kept out of the notebook: small pictures."""


def parts(script: str) -> tuple[str, list[tuple[str, str]]]:
    """The docstring of a script, and heading and code of each part.

    Parameters
    ----------
    script
        Its text.
    """
    head, *rest = _PART.split(script)
    codes = [code.strip() for code in rest[1::2]]
    return head.strip().strip('"'), list(zip(rest[::2], codes, strict=True))


def cells(script: str) -> list[dict[str, Any]]:
    """The cells of a notebook, not executed: words and code in turn."""
    head, sections = parts(script)
    texts = [("markdown", f"# lashbench in a notebook\n\n{head}")]
    for heading, code in sections:
        texts += [("markdown", heading), ("code", code)]
    return [
        {"id": f"cell-{number}", "cell_type": kind, "metadata": {}, "source": text}
        | ({"execution_count": None, "outputs": []} if kind == "code" else {})
        for number, (kind, text) in enumerate(texts)
    ]


def execute(document: dict[str, Any]) -> dict[str, Any]:
    """Run every cell in a folder of its own; raises where one fails."""
    import nbformat
    from jupyter_core.utils import run_sync
    from nbclient import NotebookClient

    notebook = nbformat.from_dict(document)
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook, timeout=_PATIENCE_S, resources={"metadata": {"path": folder}}
        )
        with client.setup_kernel():
            run_sync(client.kc.execute_interactive)(_BEFORE, store_history=False)
            for number, cell in enumerate(notebook.cells):
                client.execute_cell(cell, number)
    return json.loads(nbformat.writes(notebook))


def tidy(document: dict[str, Any]) -> dict[str, Any]:
    """Leave out what a reader has no use for: times, progress, the version of Python."""
    for cell in document["cells"]:
        cell["metadata"] = {}
        if cell["cell_type"] == "code":
            cell["outputs"] = joined(cell["outputs"])
    document["metadata"] = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return document


def joined(outputs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What a cell gave, its printed text in one piece, without what went to stderr."""
    kept = [one for one in outputs if one.get("name") != "stderr"]
    printed = [line for one in kept for line in one.get("text", ())]
    text = [{"name": "stdout", "output_type": "stream", "text": printed}] if printed else []
    return [*text, *(one for one in kept if one["output_type"] != "stream")]


def main() -> None:
    """Write the notebook."""
    made = {
        "cells": cells(SCRIPT.read_text(encoding="utf-8")),
        "metadata": {"kernelspec": {"display_name": "Python 3", "name": "python3"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    text = json.dumps(tidy(execute(made)), indent=1, ensure_ascii=False) + "\n"
    if len(text.encode()) > MOST_BYTES:
        sys.exit(f"{len(text.encode())} bytes, more than {MOST_BYTES}")
    NOTEBOOK.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
