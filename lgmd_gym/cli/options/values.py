"""Types of optional values, with a readable placeholder in the help; a check of unused options."""

from collections.abc import Collection
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

Name = Annotated[str | None, arg(metavar="NAME")]
Names = Annotated[tuple[str, ...] | None, arg(metavar="NAME [NAME ...]")]
Count = Annotated[int | None, arg(metavar="N")]
Number = Annotated[float | None, arg(metavar="X")]
File = Annotated[Path | None, arg(metavar="PATH")]
SecondFile = Annotated[Path | None, arg(metavar="[PATH]")]


def refuse_unused(options: Any, flag: str, used: Collection[str]) -> None:
    """Raise ValueError for options that have no effect beside a flag and differ from their defaults.

    Args:
        options: Options of a command.
        flag: The flag, for example "--resume".
        used: Names of the options that have an effect.
    """
    given = [
        f"--{item.name.replace('_', '-')}"
        for item in fields(options)
        if item.name not in used and getattr(options, item.name) != item.default
    ]
    if given:
        raise ValueError(f"{flag} uses the settings of its run and ignores {', '.join(given)}; remove them")
