"""Reading of files from anywhere: regular ones of limited size, so that none fills the memory or waits.

A device such as /dev/zero never ends, a named pipe waits for a writer, and a small zip file can unpack to any
size. The functions raise OSError for a file that cannot be read, and ValueError for its contents.
"""

import json
import os
import stat
import tomllib
from collections.abc import Callable
from errno import EFBIG, EINVAL
from pathlib import Path
from typing import Any
from zipfile import ZipFile

MAX_BYTES = 20_000_000  # of a text file


def read_bytes(path: Path, limit: int | None = MAX_BYTES) -> bytes:
    """Return the contents of a file.

    Args:
        path: Regular file.
        limit: Largest size [bytes]; None for any.

    Raises:
        OSError: If it cannot be read, is no regular file, or is larger than the limit.
    """
    check_regular(path, limit)
    with path.open("rb") as file:
        data = file.read() if limit is None else file.read(limit + 1)
    if limit is not None and len(data) > limit:  # a file of /proc states no size
        raise OSError(EFBIG, f"it has more than {limit} bytes", str(path))
    return data


def check_regular(path: Path, limit: int | None = MAX_BYTES) -> None:
    """Raise OSError for a file that is missing, no regular file, or larger than a limit [bytes]."""
    found = os.stat(path)
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(EINVAL, "it is a folder", str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(EINVAL, "it is a device or pipe, not a regular file", str(path))
    if limit is not None and found.st_size > limit:
        raise OSError(EFBIG, f"it has {found.st_size} bytes, more than {limit}", str(path))


def read_text(path: Path, limit: int | None = MAX_BYTES) -> str:
    """Return the text of a UTF-8 file, without a byte order mark; see `read_bytes`."""
    return read_bytes(path, limit).decode("utf-8-sig")


def read_toml(path: Path) -> dict[str, Any]:
    """Return the values of a TOML file; see `read_text`."""
    return _shallow(lambda: tomllib.loads(read_text(path)))


def read_json(path: Path, object_pairs_hook: Callable[[list[tuple[str, Any]]], Any] | None = None) -> Any:
    """Return the value of a JSON file; see `read_text` and `json.loads`."""
    return _shallow(lambda: json.loads(read_text(path), object_pairs_hook=object_pairs_hook))


def _shallow(parse: Callable[[], Any]) -> Any:
    try:
        return parse()
    except RecursionError:
        raise ValueError("its values are nested too deeply") from None


def check_members(archive: ZipFile, limit: int) -> None:
    """Raise ValueError if the members of a zip file unpack to more than a limit [bytes]."""
    size = sum(item.file_size for item in archive.infolist())
    if size > limit:
        raise ValueError(f"it unpacks to {size} bytes, more than {limit}")
