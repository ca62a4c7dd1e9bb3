"""Files and folders that are complete or absent, and a lock on a folder."""

import fcntl
import os
import shutil
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from errno import ENOENT
from pathlib import Path
from zipfile import BadZipFile, ZipFile

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


@contextmanager
def complete_file(path: Path) -> Generator[Path, None, None]:
    """Yield the path of a temporary file in the same folder; at the end of the block it becomes `path`.

    An interruption, a full disk or a power cut leaves the old contents of `path`, or none. The temporary name
    ends in ".part".

    Args:
        path: File to write; its folder is made if it does not exist.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.part")
    try:
        with _naming(path):
            yield part
            _sync(part)
            part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    if os.name == "posix":  # elsewhere a folder cannot be opened
        _sync(path.parent)


@contextmanager
def complete_folder(path: Path, kind: str) -> Generator[Path, None, None]:
    """Yield a temporary folder beside `path`; at the end of the block it becomes `path`.

    An exception or Ctrl-C removes it, so that the same command can be repeated. One that a killed command
    left is emptied and used.

    Args:
        path: Folder to make, which must not exist.
        kind: Kind of folder, for the messages ("run folder", ...).

    Raises:
        ValueError: If it exists, cannot be made, or another command is making it.
    """
    part = path.with_name(f"{path.name}.part") if path.name else path
    lock = _claim(part, path, kind)
    try:
        with _naming(path):
            yield part
            for file in filter(Path.is_file, part.rglob("*")):
                _sync(file)
            part.rename(path)
            (path / LOCK_FILE).unlink()
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    finally:
        lock.release()


def _claim(part: Path, path: Path, kind: str) -> FolderLock:
    """Make and lock an empty temporary folder for `path`."""
    try:
        if path.exists():
            raise _refusal(path, kind, FileExistsError())
        part.mkdir(parents=True)
    except FileExistsError:
        if not (part / LOCK_FILE).is_file():
            raise ValueError(
                f"{str(part)!r} is needed for unfinished results; remove it, or choose another --out"
            ) from None
    except OSError as error:
        raise _refusal(path, kind, error) from None
    lock = FolderLock(part, kind)
    for item in part.iterdir():
        if item.is_dir() and not item.is_symlink():
            shutil.rmtree(item)
        elif item.name != LOCK_FILE:
            item.unlink()
    return lock


def new_folder(path: Path, kind: str) -> None:
    """Create a folder with its parents.

    Args:
        path: Folder to create.
        kind: Kind of folder, for the message ("run folder", ...).

    Raises:
        ValueError: If it exists or cannot be created.
    """
    try:
        path.mkdir(parents=True)
    except OSError as error:
        raise _refusal(path, kind, error) from None


def check_new_file(path: Path, name: str) -> None:
    """Check that a file does not exist and can be created, before the work whose result it gets.

    Args:
        path: File to write later.
        name: Name of the file in the message, for example "--best".

    Raises:
        ValueError: If the file exists or cannot be created.
    """
    try:
        path.open("xb").close()
    except FileExistsError:
        raise ValueError(f"{name} {str(path)!r} exists; choose another file") from None
    except OSError as error:
        raise ValueError(
            f"{name} {str(path)!r} cannot be created ({error.strerror}); choose another file"
        ) from None
    path.unlink()


def check_output_file(path: Path, name: str, force: bool) -> None:
    """Check that a file can be written, and does not exist unless `force` is set.

    Args:
        path: File to write later.
        name: Name of the file in the message.
        force: Whether an existing file may be replaced.

    Raises:
        ValueError: If the file exists or cannot be created.
    """
    if not path.is_file():
        check_new_file(path, name)
    elif not force:
        raise ValueError(f"{name} {str(path)!r} exists; choose another file, or replace it with --force")


def is_intact_zip(path: Path, member: str) -> bool:
    """Return whether a zip file (.zip or .npz) contains a member and every checksum in it is right."""
    try:
        with ZipFile(path) as archive:
            # The end of a truncated file may look like a zip file: torch stores zip files within zip files.
            return member in archive.namelist() and archive.testzip() is None
    except (OSError, ValueError, BadZipFile, EOFError, zlib.error, NotImplementedError, RuntimeError):
        return False


def _refusal(path: Path, kind: str, error: OSError) -> ValueError:
    """Return the error of a folder that exists or cannot be created."""
    exists = isinstance(error, FileExistsError)
    reason = "already exists" if exists else f"cannot be created ({error.strerror})"
    return ValueError(f"{kind} {str(path)!r} {reason}; choose another --out")


@contextmanager
def _naming(path: Path) -> Generator[None, None, None]:
    """Add a path to input and output errors without one, such as a full disk."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(path)
        raise


def _sync(path: Path) -> None:
    """Store a file or the entries of a folder on the disk."""
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def replace_file(file: Path, text: str) -> None:
    """Write a file atomically: an interruption leaves either the old or the new contents."""
    with complete_file(file) as part:
        part.write_text(text, encoding="utf-8")
