"""Options of `drive`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, arg

from lgmd_gym.cli.options.values import File, Name, Names


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Run one episode and print how it ended; optionally show it in a window or write a video.

    Every picture shows the camera frame, the neuron's layers and spikes, and the road from above.
    """

    target: Annotated[Positional[str], arg(metavar="ENV|CASE|TRAFFIC|FILE")]
    """Environment id (LGMD/CCRs-v0), case (quick/CCRs/v30), kind of traffic (traffic/merge), or path of a
    scenario file, suite file or OpenSCENARIO file."""
    case: Name = None
    """Case of a file with several, for example CutIn/v70/gap8m."""
    agent: str = "spike-threshold"
    """Agent, with options as in spike-threshold:threshold=45."""
    video: File = None
    """Video file to write (.mp4, .gif, ...); must not exist."""
    live: bool = False
    """Show a window in real time; Escape closes it."""
    overlays: Annotated[tuple[str, ...], arg(metavar="[NAME ...]")] = ("zone", "targets")
    """Overlays on the camera frame: zone (lane ahead), targets (vehicles); --overlays alone for none."""
    seed: int = 0
    """Seed of the environment: start position and grey level of the target."""
    world: Annotated[str | None, arg(metavar="N|laboratory")] = None
    """World: a number from 0 to 9999, or laboratory. Default: a training world, drawn by the seed."""
    condition: Name = None
    """Camera condition: clear, night, night_upper_beam, fog, rain or low_sun, or mixed for that of the world;
    not for random levels, which draw their own. Default: clear."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    trust: bool = False
    """Load the modules that the file names; they can run any code."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=NUMBER [...]")] = ()
    """Scenario arguments in SI units, for example --set ego_speed=8.3 shade=40."""
