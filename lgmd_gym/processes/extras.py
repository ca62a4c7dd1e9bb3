"""How to install the optional packages of an extra, for this installation."""

import json
from importlib.metadata import distributions
from pathlib import Path
from urllib.parse import unquote, urlparse

from lgmd_gym.aliases import Values

PACKAGE = "lgmd-gym"


def missing_extra(what: str, extra: str) -> ValueError:
    """Return the error of something that requires packages that are not installed.

    Args:
        what: What requires them, for example "training".
        extra: Name of the extra in `pyproject.toml`.
    """
    return ValueError(f'{what} requires the extra "{extra}": {install_command(extra)}')


def install_command(extra: str) -> str:
    """Return the command that installs an extra.

    It names the clone if the package was installed from one, because an index may not have this version.

    Example:
        >>> install_command("train")
        'pip install -e ".[train]"'
    """
    folder, editable = _source()
    if folder is None:
        return f'pip install "{PACKAGE}[{extra}]"'
    place = "." if folder == Path.cwd() else str(folder)
    return f'pip install {"-e " if editable else ""}"{place}[{extra}]"'


def _source() -> tuple[Path | None, bool]:
    """Return the clone from which the package was installed, or None, and whether it is editable."""
    for item in distributions(name=PACKAGE):
        source: Values = json.loads(item.read_text("direct_url.json") or "{}")
        url = urlparse(str(source.get("url", "")))
        folder = Path(unquote(url.path))
        if url.scheme == "file" and "dir_info" in source and (folder / "pyproject.toml").is_file():
            return folder, bool(source["dir_info"].get("editable", False))
    return None, False
