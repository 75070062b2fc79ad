"""``lashbench completion``: what a shell needs to complete commands and options.

Owns the options of the verb; the script is the parser's own.
"""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from tui.text.output import Injected

__all__ = ["completion"]


def completion(
    shell: Annotated[Literal["bash", "zsh", "fish"], Parameter(name="SHELL")],
    /,
    *,
    console: Injected,
) -> None:
    """Print a script that completes lashbench's commands and options in a shell.

    For instance, for bash: lashbench completion bash >
    ~/.local/share/bash-completion/completions/lashbench

    Parameters
    ----------
    shell
        The shell that is to complete.
    """
    from tui.cli import build_app

    console.data(build_app().generate_completion(prog_name="lashbench", shell=shell))
