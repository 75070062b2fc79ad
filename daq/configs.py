"""Where the files that come with lashbench are found: units, benches, recipes, samples, posteriors.

Installed as a wheel they lie inside the package, in a checkout (an editable
install) in `configs/` beside it. This module finds and lists files; it never
interprets one.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal

from daq.errors import ConfigurationError

__all__ = [
    "config_names",
    "config_path",
    "kept_runs",
    "posterior_folder",
    "sample_names",
    "sample_path",
]

Kind = Literal["units", "benches", "recipes", "paper", "templates", "profiles"]


def _root() -> Path:
    package = Path(str(files("daq")))
    installed = package / "_configs"
    return installed if installed.is_dir() else package.parent / "configs"


def config_names(kind: Kind) -> list[str]:
    """Names of the files of one kind that come with lashbench, without suffix, sorted."""
    return sorted(path.stem for path in (_root() / kind).glob("*.toml"))


def config_path(kind: Kind, name_or_path: str) -> Path:
    """The file meant by a bare name that comes with lashbench, or by a path.

    Raises
    ------
    ConfigurationError
        If it is neither; the message lists the names that exist.
    """
    if name_or_path.lower() in config_names(kind):
        return _root() / kind / f"{name_or_path.lower()}.toml"
    path = Path(name_or_path)
    try:
        if path.is_file():
            return path
        what = "is a directory" if path.is_dir() else "was not found"
    except (OSError, ValueError):
        what = "is no file name"
    raise ConfigurationError(
        f"{kind[:-1] if kind != 'benches' else 'bench'} {name_or_path!r} {what}; "
        f"give the path of a TOML file or one of: {', '.join(config_names(kind))}"
    )


def sample_names() -> list[str]:
    """Names of the sample responses that come with lashbench, sorted."""
    return sorted(path.stem for path in (_root() / "samples").glob("*.csv"))


def sample_path(name: str) -> Path:
    """The file of a sample response.

    Raises
    ------
    ConfigurationError
        If there is none of that name.
    """
    if name not in sample_names():
        raise ConfigurationError(
            f"sample {name!r} was not found; use one of: {', '.join(sample_names())}"
        )
    return _root() / "samples" / f"{name}.csv"


def posterior_folder() -> Path:
    """The folder of the trained posteriors that come with lashbench."""
    return _root() / "posteriors"


def kept_runs() -> Path:
    """The archive of the runs that come with lashbench, see `analysis.ensemble.run_cache`."""
    return _root() / "runs.zip"
