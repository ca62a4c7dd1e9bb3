"""The `stimuli` command; the attribute docstrings of `Stimuli` are its help texts."""

from dataclasses import dataclass, fields
from itertools import count
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import File, default_out


@dataclass(frozen=True, kw_only=True)
class Stimuli:
    """Write synthetic stimuli as lossless videos, each with the ground truth of every frame.

    Squares and discs that loom, recede, translate and elongate, gratings, and squares in gratings and in a
    shifting panorama. For each stimulus the folder contains NAME.mkv and NAME.csv; manifest.json has the
    parameters and the SHA-256 of the frames, which do not depend on the machine.
    """

    names: Annotated[Positional[tuple[str, ...]], arg(metavar="NAME [NAME ...]")] = ()
    """Stimuli, or patterns such as 'looming-disc-*'. Default: all 70."""
    out: File = None
    """Folder to write; must not exist. Default: runs/stimuli-DATE-TIME."""
    fps: float = 30.0
    """Frame rate [Hz]."""
    size: Annotated[tuple[int, int], arg(metavar="WIDTH HEIGHT")] = (540, 270)
    """Size of the frames [px]; every width has a horizontal field of 84 degrees."""
    suffix: Literal["mkv", "y4m"] = "mkv"
    """Format of the videos: mkv is FFV1, y4m uncompressed."""
    picture: File = None
    """Image for the shifting panorama. Default: a random image with a natural spectrum."""
    check: File = None
    """Folder of stimuli to compare with its manifest, instead of writing one."""


def run(options: Stimuli) -> int:
    """Write the stimuli, or check a folder of them; return 0."""
    from lgmd_gym.cli.clips import progress_bar
    from lgmd_gym.clips.video import MAX_SIZE, MIN_SIZE
    from lgmd_gym.errors import check_size, check_within
    from lgmd_gym.paper.stimulus_files import check_stimuli, choose_stimuli, set_screen, write_stimuli
    from lgmd_gym.processes.files import complete_folder

    console, steps = make_console(), count(1)
    if options.check is not None:
        if any(getattr(options, item.name) != item.default for item in fields(options)[:-1]):
            raise ValueError(f"--check {options.check} writes nothing; remove the other options")
        manifest = check_stimuli(options.check)
        text = f"{len(manifest['stimuli'])} stimuli equal their manifest, SHA-256 {manifest['sha256']}"
        console.print(text, soft_wrap=True, highlight=False)
        return 0
    check_within("--fps", options.fps, 1.0, 1000.0, "Hz")
    check_size("--size", options.size, MIN_SIZE, MAX_SIZE, "WIDTH HEIGHT")
    stimuli = choose_stimuli(options.names, options.picture)
    out, screen = default_out(options.out, "stimuli"), set_screen(options.fps, options.size)
    with complete_folder(out, "folder") as folder, progress_bar("stimuli", len(stimuli)) as set_progress:
        manifest = write_stimuli(
            folder,
            stimuli,
            screen,
            suffix=options.suffix,
            picture=options.picture,
            on_step=lambda: set_progress(next(steps)),
        )
    text = f"{len(stimuli)} stimuli, SHA-256 {manifest['sha256']}: {out}"
    console.print(text, soft_wrap=True, highlight=False)
    return 0
