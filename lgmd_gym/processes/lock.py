"""A lock on a folder, so that only one process at a time writes to it."""

import fcntl
import os
from errno import ENOENT
from pathlib import Path

LOCK_FILE = ".lock"


class FolderLock:
    """Exclusive lock on a folder, held until `release` or the end of the process, however it ends.

    The lock belongs to the open file, so a `.lock` that remains in the folder means nothing. Reading a folder
    requires no lock.

    Args:
        path: Existing folder.
        kind: Kind of folder, for the messages.

    Raises:
        ValueError: If another process holds the lock, or the folder cannot be locked.
    """

    def __init__(self, path: Path, kind: str = "run folder") -> None:
        file = path / LOCK_FILE
        try:
            self._file = file.open("a+b", buffering=0)
        except OSError as error:
            raise ValueError(f"{kind} {str(path)!r} cannot be written ({error.strerror})") from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not os.path.samestat(os.fstat(self._file.fileno()), file.stat()):
                raise FileNotFoundError(ENOENT, os.strerror(ENOENT))  # renamed or removed meanwhile
            self._file.truncate(0)
            self._file.write(str(os.getpid()).encode())
        except BlockingIOError:
            self._file.seek(0)
            holder = self._file.read(20).decode(errors="replace") or "(unknown)"
            self.release()
            raise ValueError(
                f"{kind} {str(path)!r} is in use by process {holder}; wait for its end, or stop it"
            ) from None
        except OSError as error:
            self.release()
            raise ValueError(
                f"{kind} {str(path)!r} cannot be locked ({error.strerror}); use another disk"
            ) from None

    def release(self) -> None:
        """Release the lock."""
        self._file.close()
