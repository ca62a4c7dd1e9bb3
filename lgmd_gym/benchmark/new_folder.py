"""Folders that are made once and never overwritten."""

from pathlib import Path


def new_folder(path: Path, kind: str) -> Path:
    """Make a folder, its parents included, and return it.

    Args:
        path: Where; must not exist.
        kind: What it is, for the message ("run folder", ...).

    Raises:
        ValueError: If it exists or cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=False)
    except FileExistsError:
        raise ValueError(f"{kind} {str(path)!r} exists and is kept; choose another --out") from None
    except OSError as error:
        raise ValueError(
            f"{kind} {str(path)!r} cannot be made ({error.strerror}); choose another --out"
        ) from None
    return path
