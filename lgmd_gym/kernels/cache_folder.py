"""A folder for compiled kernels where numba finds none: a read-only installation without a home."""

import os
import stat
import sys
import tempfile
from multiprocessing import parent_process

from numba.core import config

VARIABLE = "NUMBA_CACHE_DIR"


def use_temporary_folder() -> None:
    """Let numba store kernels in a temporary folder; the main process prints a line.

    Raises:
        OSError: If not even that folder is writable.
    """
    folder = _temporary_folder()
    config.CACHE_DIR = folder  # pyright: ignore[reportAttributeAccessIssue]
    if parent_process() is None:
        print(
            f"lgmd-gym: numba stores compiled kernels in {folder}, because neither the installation nor a "
            f"cache folder of the user is writable; set {VARIABLE} to choose another folder",
            file=sys.stderr,
        )


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
