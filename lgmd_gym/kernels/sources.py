"""Stamp of the sources of a kernel: a change in any file that it depends on invalidates numba's cache.

Numba compares the time stamp of the kernel's own file only, and not the files of the kernels that it calls or
of the constants that it reads.
"""

import hashlib
import os
import re
from functools import cache
from pathlib import Path

PROFILE_VARIABLE = "LGMD_GYM_PROFILE"  # compiles time measurements into kernels, see `clock`
_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(
    r"^\s*(?:from\s+(lgmd_gym[\w.]*)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+(lgmd_gym[\w.]*))", re.M
)


@cache
def source_stamp(module: str) -> str:
    """Return a digest of the source of a module and of all modules of this package that it imports.

    Args:
        module: Dotted name, for example "lgmd_gym.camera.pose".
    """
    found: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = _file_of(name)
        if name in found or path is None:
            continue
        found[name], imported = _read(path)
        waiting += imported
    digest = hashlib.sha256(os.environ.get(PROFILE_VARIABLE, "").encode())
    for name in sorted(found):
        digest.update(name.encode() + b"\0" + found[name])
    return digest.hexdigest()


@cache
def _read(path: Path) -> tuple[bytes, list[str]]:
    """Return the digest of a file, and the names that it may import from this package."""
    source = path.read_bytes()
    names: list[str] = []
    for base, items, plain in _IMPORT.findall(source.decode()):
        names += [plain or base, *(f"{base}.{item}" for item in re.findall(r"\w+", items) if base)]
    return hashlib.sha256(source).digest(), names


@cache
def _file_of(module: str) -> Path | None:
    """Return the file of a module of this package; None for a name that is not a module."""
    parts = module.split(".")[1:]
    for folder in (_PACKAGE, _PACKAGE.parent):  # envs and agents may be beside the package
        for path in (folder.joinpath(*parts, "__init__.py"), folder.joinpath(*parts).with_suffix(".py")):
            if parts and path.is_file():
                return path
    return None
