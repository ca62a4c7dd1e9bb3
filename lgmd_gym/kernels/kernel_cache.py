"""A folder in which numba can store compiled kernels, also for a read-only installation without a home."""

import os
import stat
import sys
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


def ensure_kernel_cache(package: Path) -> None:
    """Let numba store kernels in a temporary folder if it could store them nowhere; print a line then.

    Without a writable folder, numba raises RuntimeError for the first kernel. Workers inherit the folder.
    The call comes before the import of any kernel. It does not import numba, which takes half a second.

    Args:
        package: Folder of this package, where numba stores kernels if it is writable.
    """
    given = os.environ.get(VARIABLE)
    if any(_is_writable(folder) for folder in ([Path(given)] if given else []) + [package, _user_cache()]):
        return
    try:
        folder = _temporary_folder()
    except OSError:
        return  # numba then raises its own error
    os.environ[VARIABLE] = folder
    if "numba" in sys.modules:  # it has read the variable
        sys.modules["numba"].config.CACHE_DIR = folder  # pyright: ignore
    print(
        f"lgmd-gym: numba stores compiled kernels in {folder}, because neither the installation nor a cache "
        f"folder of the user is writable; set {VARIABLE} to choose another folder",
        file=sys.stderr,
    )


def _is_writable(folder: Path) -> bool:
    """Return whether a folder is writable, or can be created."""
    existing = next((item for item in (folder, *folder.absolute().parents) if os.path.lexists(item)), folder)
    try:
        with tempfile.TemporaryFile(dir=existing):  # as numba does; permissions alone do not decide
            return True
    except OSError:
        return False


def _user_cache() -> Path:
    """Return the folder that numba uses for an installation that is not writable."""
    home = os.path.expanduser("~")
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", home))
    if sys.platform == "darwin":
        return Path(home, "Library", "Caches", "numba")
    return Path(os.environ.get("XDG_CACHE_HOME", os.path.join(home, ".cache")), "numba")


def _temporary_folder() -> str:
    """Return a temporary folder that only this user can write to, the same for every process of the user.

    Cached kernels are code: a folder that another user prepared is not used.
    """
    if not hasattr(os, "getuid"):
        return tempfile.mkdtemp(prefix="lgmd-gym-numba-")
    folder = os.path.join(tempfile.gettempdir(), f"lgmd-gym-numba-{os.getuid()}")
    try:
        os.mkdir(folder, 0o700)
    except FileExistsError:
        found = os.lstat(folder)
        if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o022:
            return tempfile.mkdtemp(prefix="lgmd-gym-numba-")
    return folder
