"""Find `lgmd_gym.envs` and `lgmd_gym.agents` in sources without the symbolic links to them."""

from pathlib import Path

LINKS = ("envs", "agents")


def linked_folders(package: Path) -> list[str]:
    """Return the folder to add to the path of the package, so that it contains `LINKS`; empty if it does.

    Git writes symbolic links as text files where `core.symlinks` is false, as on Windows; archives may lack
    them.

    Args:
        package: Folder of this package: installed, or in a clone beside the folders of `LINKS`.

    Raises:
        ImportError: If the folders are neither in the package nor beside it.
    """
    if all((package / name).is_dir() for name in LINKS):
        return []
    if all((package.parent / name / "__init__.py").is_file() for name in LINKS):
        return [str(package.parent)]
    links = " ".join(f"lgmd_gym/{name}" for name in LINKS)
    raise ImportError(
        f"{package} lacks the symbolic links {' and '.join(LINKS)}; in the clone, run: "
        f"git config core.symlinks true && rm -f {links} && git checkout -- {links}"
    )
