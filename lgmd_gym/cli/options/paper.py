"""Options of `paper`; attribute docstrings are the help texts."""

from dataclasses import dataclass

from lgmd_gym.cli.options.values import File, Names


@dataclass(frozen=True, kw_only=True)
class Paper:
    """Repeat the experiments of the LGMD paper; write figures and a table of its claims.

    The paper's crash and near-miss clips are not included in this package; pass a folder of your own. With
    --realism, compare statistics of simulated drives with those of the clips instead.
    """

    out: File = None
    """Run folder; must not exist. Default: runs/paper-DATE-TIME, or runs/realism-DATE-TIME."""
    clips: File = None
    """Folder of driving clips; requires --crashes, except with --realism."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash)."""
    picture: File = None
    """Image for the shifting panorama. Default: a random image with a natural spectrum."""
    realism: bool = False
    """Compare simulated drives with the clips: realism.md, realism.csv, drives.csv, realism.png."""
    clip_hfov_deg: float = 90.0
    """With --realism: horizontal field of view of the clips [degrees]; 90 has the pixels per degree of a
    dash camera of 120 to 140 degrees on the diagonal in the centre of the frame."""
    ignore_bottom: float = 0.0
    """With --realism: share of the height, at the bottom, that is left out: bonnets and captions."""
    night: Names = None
    """With --realism: clips at night. Default: those with a median grey below 75."""
    seeds: int = 3
    """With --realism: seeds of every simulated drive."""
    worlds: int = 20
    """With --realism: number of training worlds of the simulated drives; 0 for the plain laboratory."""
