"""Options of each command; attribute docstrings are the help texts."""

from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import Positional, arg

# Optional values with a readable placeholder in the help.
Name = Annotated[str | None, arg(metavar="NAME")]
Names = Annotated[tuple[str, ...] | None, arg(metavar="NAME [NAME ...]")]
Count = Annotated[int | None, arg(metavar="N")]
Number = Annotated[float | None, arg(metavar="X")]
File = Annotated[Path | None, arg(metavar="PATH")]
SecondFile = Annotated[Path | None, arg(metavar="[PATH]")]


def refuse_unused(options: Any, flag: str, used: Collection[str]) -> None:
    """Raise ValueError for options that have no effect beside a flag and differ from their defaults.

    Args:
        options: Options of a command.
        flag: The flag, for example "--resume".
        used: Names of the options that have an effect.
    """
    given = [
        f"--{item.name.replace('_', '-')}"
        for item in fields(options)
        if item.name not in used and getattr(options, item.name) != item.default
    ]
    if given:
        raise ValueError(f"{flag} uses the settings of its run and ignores {', '.join(given)}; remove them")


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Run agents on a suite, print the scores and write a run folder.

    The folder contains episodes.jsonl (one row per episode, written as it finishes), episodes.csv,
    summary.csv, report.html with its figures, run.toml, run.json, time series and one PNG per case. Ctrl-C
    keeps the finished episodes.
    """

    suite: Names = None
    """Suite name (see `lgmd-gym list suites`), or paths: suite or scenario files (.toml, .json), OpenSCENARIO
    files (.xosc), folders with such files. Default: quick."""
    agents: Names = None
    """Agents with options, for example spike-threshold:threshold=45,frames=2; MODULE:CLASS for an agent of
    your own. Default: no-brake always-brake random-brake spike-threshold stopping-zone ttc-oracle."""
    seeds: Count = None
    """Number of seeds per case; a seed sets the start position and the target's grey level. Default: 3."""
    first_seed: Count = None
    """First seed. Default: 0."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    conditions: Names = None
    """Camera conditions, each run separately: clear, night, night_upper_beam, fog, rain, low_sun, or mixed
    for that of each world. Default: clear."""
    worlds: Count = None
    """Number of worlds (asphalt, light, surroundings, brake); 0 for the plain laboratory. Default: 20."""
    first_world: Count = None
    """First world; 8000 to 8999 are the test worlds. Default: 8000."""
    road: Name = None
    """Road that moves the lens: still, smooth, normal or rough. Default: normal, in the laboratory still."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    config: File = None
    """run.toml of an earlier run to repeat; replaces the options above."""
    resume: File = None
    """Folder of an interrupted run; runs the missing episodes with the settings of that run."""
    trust: bool = False
    """Load modules and policy files that --resume, --config or the suite file names; they can run any
    code."""
    jobs: int = 2
    """Number of processes."""
    backend: Literal["processes", "dask"] = "processes"
    """Executor: local processes or a running Dask cluster."""
    address: Name = None
    """Address of the Dask scheduler, for example tcp://10.0.0.1:8786."""
    out: File = None
    """Run folder; must not exist. Default: runs/SUITE-DATE-TIME."""
    plots: bool = True
    """Draw one PNG per case."""
    report: bool = True
    """Write report.html."""


@dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare agents in pairs, or several training runs as arms, on the same episodes.

    Pairs: differences B − A over episodes of the same case, seed and condition, with 95 % intervals from a
    bootstrap over cases. Arms: mean return and shares of each arm, and the difference to the first arm. Arms
    need one run of all agents: lgmd-gym bench --suite random --agents policy:a0.zip policy:a1.zip ttc-oracle.
    """

    run_a: Positional[Path]
    """Run folder of A."""
    run_b: Positional[SecondFile] = None
    """Run folder of B. Default: compare agents within the first run."""
    agents: Names = None
    """Agent of A and agent of B. Default: every agent of both runs, or all pairs within one run."""
    arms: Names = None
    """Arms of the first run, each NAME=AGENT,AGENT,... (wildcards allowed, for example lgmd=policy:*lgmd*) or
    a single agent. --arms without names makes every agent an arm."""
    out: File = None
    """PNG or SVG file for the figure of the paired differences; must not exist."""


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
    """Write an MCAP file for Foxglove: frames, layers and signals of the neuron (needs lgmd-gym[mcap])."""
    plots: bool = True
    """Draw one figure per clip."""


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


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train a policy with stable-baselines3; run it with --agents policy:FOLDER/policy.zip.

    The folder contains TensorBoard logs, checkpoints, the evaluations on the validation split and the policy
    with the best mean return in them. Ctrl-C keeps the checkpoints; --resume continues from the last one.
    """

    algo: str = "dqn"
    """Algorithm: sac, ppo, dqn, or offline (trained on recorded episodes in minutes)."""
    env: str = "LGMD/RandomBraking-v0"
    """Environment id; RandomBraking is trained on its split train and evaluated on its split validation."""
    camera: Names = None
    """Camera presets, one neuron each. Default: fovea tele wide."""
    sensors_of: Name = None
    """Agent whose cameras are used instead, for example stopping-zone; all-round adds fields at the sides."""
    inputs: Names = None
    """Policy inputs: spike_frequency, spike_peak, membrane_potential, ffi, ego_speed, speed_change and
    ego_yaw_rate; also frame; with the cameras of stopping-zone, also zones, zones_spikes and zones_ffi; with
    those of all-round, also sides and sides_ffi.
    Default: from the hyperparameters."""
    demands: Annotated[tuple[float, ...] | None, arg(metavar="[X ...]")] = None
    """Demands that the policy chooses from, from -1 (full braking) to 1; --demands alone for a continuous
    demand. Default: 0 -0.4 -1 for ppo and dqn, continuous for sac, 0 -1 for offline."""
    n_timesteps: Count = None
    """Number of policy decisions (offline: of recorded episodes). Default: from the hyperparameters."""
    seed: int = 0
    """Seed of the network and the environments."""
    hyperparams: File = None
    """YAML file in rl-zoo's format. Default: the file of this package."""
    eval_freq: int = 16_000
    """Number of decisions between two evaluations; offline evaluates after every epoch."""
    eval_episodes: Count = None
    """Number of episodes per evaluation. Default: 60; for offline, 600."""
    recordings: File = None
    """Folder of an offline training run with the same cameras, to reuse its recorded episodes."""
    traffic_episodes: int = 0
    """Number of traffic episodes, in which braking is false, that offline trains on in addition."""
    jobs: int = 2
    """Number of processes that record episodes."""
    out: File = None
    """Training folder; must not exist. Default: runs/train-ALGO-DATE-TIME."""
    resume: File = None
    """Folder of an interrupted training run, to continue it with its own options."""


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Search the parameters of a rule on training levels of LGMD/RandomBraking-v0 and false-reaction cases.

    Validation levels choose between the defaults and the best trials; test levels and protocol suites are
    not used. A trial takes seconds for a latching rule with fixed sensors, because the sensor outputs are
    recorded once. It takes about a minute with --cameras, --camera-geometry or --neuron, and minutes for a
    rule that does not latch (graded).
    """

    agent: str = "stopping-zone"
    """Name of a rule."""
    cameras: tuple[str, ...] = ()
    """Camera presets to choose from, for a rule with one camera; for example fovea tele wide."""
    camera_geometry: bool = False
    """Also search the parameters that determine the rule's own cameras (stopping-zone: deceleration and
    reaction)."""
    neuron: tuple[str, ...] = ()
    """Neuron parameters to search, each from half to twice its default; for example sigma_3 t_sp."""
    trials: int = 40
    """Number of trials to add to the study."""
    levels: int = 100
    """Number of levels of each split; half of them are threats."""
    seeds: int = 1
    """Number of seeds of the false-reaction suite, from 1000 for trials and from 2000 for validation."""
    false_cost: float = 1.0
    """Cost of a false activation, relative to a contact at full speed."""
    jobs: int = 2
    """Number of processes."""
    study: Path = Path("tune.db")
    """SQLite file of the study; an existing study is resumed."""
    best: Path = Path("best.toml")
    """TOML file for the best parameters; must not exist. BEST-neuron.toml gets the neuron parameters."""
    sensitivity: bool = False
    """Print the sensitivity table (each parameter shifted by 20 % down and up) instead of searching."""


@dataclass(frozen=True, kw_only=True)
class List:
    """List suites, agents, environments, cameras or cases.

    A list that is longer than the terminal opens in a pager ($PAGER, else less).
    """

    what: Positional[Literal["all", "suites", "agents", "envs", "cameras", "cases"]] = "all"
    """Table to print; all has no cases."""
    module: Names = None
    """Modules with scenario families of your own to list: my_scenarios, or my_scenarios:MyFamily."""
    pager: bool = True
    """Use a pager in a terminal."""


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Write, draw, check or export scenarios.

    lgmd-gym scenario new [FILE.toml] writes a commented scenario file to start from. lgmd-gym scenario show
    TARGET draws a scenario file, an OpenSCENARIO file, an environment id or a case from above at several
    times, with all speeds, as a picture. lgmd-gym scenario check PATH [PATH ...] plays every cell of
    OpenSCENARIO files and folders without braking, and prints one row per file: the cells, the contacts, and
    the largest deviations of impact location, impact speed and time from what the parameters and positions of
    the file state. lgmd-gym scenario export CASE --to FILE.xosc writes a case as OpenSCENARIO 1.3, and its
    road as OpenDRIVE next to it.
    """

    action: Positional[Literal["new", "show", "check", "export"]]
    """Write a template, draw a scenario, compare files, or export a case."""
    targets: Annotated[Positional[tuple[str, ...]], arg(metavar="FILE|PATH|CASE [PATH ...]")]
    """File to write (default: scenario.toml); scenario to draw; files and folders to compare; or the name of
    a case, for example quick/CCRs/v30."""
    to: File = None
    """Picture (.png, .svg; default: TARGET.png) or OpenSCENARIO file (.xosc) to write; must not exist."""
    force: bool = False
    """Replace an existing template or picture."""
    case: Name = None
    """Case to draw, of a file with several."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    trust: bool = False
    """Load the modules that the file names; they can run any code."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=NUMBER [...]")] = ()
    """Arguments of the scenario to draw, in SI units."""
    jobs: int = 2
    """Number of processes that compare files."""


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """Write an HTML page with a video of every scenario and the results of the agents; takes minutes.

    The folder contains index.html, which needs no network connection.
    """

    out: Path = Path("gallery")
    """Folder; must not exist."""
    families: Names = None
    """Scenario families or kinds of traffic, for example CCRs merge. Default: all."""
    agent: str = "spike-threshold"
    """Agent in the videos."""
    seeds: int = 3
    """Number of seeds per scenario for the results."""


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check package versions, numba's cache, the video codec and the display, and simulate for two seconds.

    The exit code is 1 if a check finds a fault; the output suggests a fix.
    """
