"""Options of `video`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, arg

from lgmd_gym.cli.options.values import Count, File, Number


@dataclass(frozen=True, kw_only=True)
class Video:
    """Run the neuron on video clips: spike traces, figures, overlay videos, a detection table.

    For each clip the run folder contains trace.csv (one row per frame), trace.png and, with --overlay,
    overlay.mp4. With --events it contains scores.csv and clip_scores.csv.
    """

    clips: Annotated[Positional[tuple[str, ...]], arg(metavar="CLIP [CLIP ...]")]
    """Video files in any format that ffmpeg reads, or folders with video files."""
    configs: tuple[str, ...] = ("paper",)
    """Named configurations of the neuron, compared in one table if several: paper, conservative, paper-18hz,
    t_sf-60, t_sp-0.78, released, off-only, fixed-inhibition, yue-rind-2006; or all."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash); prints the detection table."""
    crash_frame: Count = None
    """Crash frame of a single clip, 0-based; prints the detection table."""
    events: File = None
    """CSV file with the columns file,event_s (seconds; empty for no event), optionally start_s,end_s; prints
    recall and average precision 0.5, 1.0 and 1.5 s before the event, and the time to accident."""
    false_alarm_cap: float = 0.1
    """With --events: highest share of 1.5 s windows in alarm in clips without an event."""
    out: File = None
    """Run folder; must not exist. Default: runs/video-DATE-TIME."""
    params: File = None
    """TOML file of LGMD parameters; replaces those of the configuration."""
    threshold: Number = None
    """Alarm level T_sf [spikes/s]; it applies to one frame rate."""
    fps: Number = None
    """Frame rate to resample to [Hz]; the neuron's response depends on it. Default: the clip's."""
    drop_duplicates: Number = None
    """Skip frames whose difference is below this fraction of the typical difference, for example 0.25; 0
    disables the filter. Default: from the configuration."""
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None
    """Size to scale to [px]. Default: the clip's."""
    roi: Annotated[
        tuple[int, int, int, int] | None,
        arg(metavar="TOP LEFT HEIGHT WIDTH"),
    ] = None
    """Region of interest of the neuron [px]. Default: the whole frame."""
    overlay: bool = False
    """Write the overlay video: frame, excitation, spikes and alert indicator."""
    mcap: bool = False
    """Write an MCAP file for Foxglove: frames, layers and signals of the neuron (requires the extra mcap)."""
    plots: bool = True
    """Draw one figure per clip."""
