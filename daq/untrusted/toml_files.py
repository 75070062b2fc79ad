"""Reading a TOML file into a checked model, whole or not at all.

Owns the one way in which every fault of a file is named in a single message.
What a file may hold is said by the model that is handed in.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from daq.errors import ConfigurationError
from daq.untrusted.bounded_text import parse_toml, read_text

__all__ = ["NonNegative", "Positive", "Section", "load_toml", "read_toml"]

_LIMIT_BYTES = 1 << 20

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Section(BaseModel):
    """A table of a file: unknown keys and wrong types are faults, not hints."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


Model = TypeVar("Model", bound=BaseModel)


def load_toml(model: type[Model], path: Path) -> Model:
    """Read a file and check it against a model.

    Raises
    ------
    ConfigurationError
        If it cannot be read, is not TOML, or any key or value is wrong; the
        message names the file, then key and fault for each thing that is.
    """
    document = read_toml(path)
    try:
        return model.model_validate(document)
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(str(part) for part in fault['loc'])}: {fault['msg']}"
            + ("" if fault["type"] == "missing" else f" (got {fault['input']!r})")
            for fault in error.errors()
        )
        raise ConfigurationError(f"{path}: {faults}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """What a TOML file holds, unchecked.

    Raises
    ------
    ConfigurationError
        If it cannot be read or is not TOML.
    """
    try:
        text = read_text(path, _LIMIT_BYTES)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path}: cannot be read ({error}); give a TOML file") from error
    try:
        return parse_toml(text)
    except ValueError as error:
        raise ConfigurationError(f"{path}: is not valid TOML ({error})") from error
