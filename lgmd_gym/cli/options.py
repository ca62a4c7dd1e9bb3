"""Options of each command; attribute docstrings are the help texts."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg


def _default_hint(default: str) -> str:
    """Return the hint after a help text; an option without a default has none."""
    return "" if default in ("", "None") else f"(default: {default})"


# Optional values whose help shows a readable placeholder and no "None".
Name = Annotated[str | None, arg(metavar="NAME", help_behavior_hint=_default_hint)]
Names = Annotated[tuple[str, ...] | None, arg(metavar="NAME [NAME ...]", help_behavior_hint=_default_hint)]
Count = Annotated[int | None, arg(metavar="N", help_behavior_hint=_default_hint)]
Number = Annotated[float | None, arg(metavar="X", help_behavior_hint=_default_hint)]
File = Annotated[Path | None, arg(metavar="PATH", help_behavior_hint=_default_hint)]


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Run agents on a suite, print the scores and write a run folder.

    The folder contains episodes.jsonl (one row per episode, written as it finishes), summary.csv,
    report.html, run.toml, run.json, time series and one PNG per case. Ctrl-C keeps the finished episodes.
    """

    suite: Name = None
    """Suite name (see `lgmd-gym list suites`) or path of a suite file, NAME.toml. Default: quick."""
    agents: Names = None
    """Agents with options, for example spike-threshold:threshold=45,frames=2; MODULE:CLASS for an agent of
    your own. Default: no-brake always-brake random-brake spike-threshold stopping-zone ttc-oracle."""
    seeds: Count = None
    """Number of seeds per case; a seed sets the place on the road and the target's grey. Default: 3."""
    first_seed: Count = None
    """First seed. Default: 0."""
    conditions: Names = None
    """Camera conditions, each run separately: clear, night, fog, degraded. Default: clear."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    config: File = None
    """run.toml of an earlier run to repeat; replaces the options above."""
    resume: File = None
    """Folder of an interrupted run; runs the missing episodes with the settings of that run."""
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
    """Say how two runs differ, pair by pair: the same case, seed and condition.

    Differences are B less A, with 95 % intervals from a bootstrap that draws whole cases.
    """

    run_a: Positional[Path]
    """Run folder."""
    run_b: Positional[Path | None] = None
    """Another run folder; without it, agents within the first are compared."""
    agents: tuple[str, ...] | None = None
    """Two agents: A's and B's. Default: every agent that both runs hold, or all pairs within one."""
    out: Path | None = None
    """PNG of the differences to write; must not exist."""


@dataclass(frozen=True, kw_only=True)
class Judge:
    """Judge arms of a run: trainings of one kind taken together, or rules, over the same episodes.

    Play them first: lgmd-gym bench --suite random --seeds 1 --agents policy:a0.zip policy:a1.zip ttc-oracle.
    """

    run: Positional[Path]
    """Run folder."""
    arms: tuple[str, ...] = ()
    """An agent of the run, or name=pattern of agents, as in lgmd=policy:*lgmd*. Default: every agent."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Run one episode and print how it ended; optionally show it in a window or write a video.

    Every picture shows the camera frame, the neuron's layers and spikes, and the road from above.
    """

    target: Positional[str]
    """Environment id (LGMD/CCRs-v0), case (quick/CCRs/v30) or kind of traffic (traffic/merge)."""
    agent: str = "spike-threshold"
    """Agent, with options as in spike-threshold:threshold=45."""
    video: File = None
    """Video file to write (.mp4, .gif, ...); must not exist."""
    live: bool = False
    """Show a window in real time; Escape closes it."""
    overlays: Annotated[tuple[str, ...], arg(metavar="[NAME ...]")] = ("zone", "targets")
    """Overlays on the camera frame: zone (lane ahead), targets (vehicles); --overlays alone for none."""
    seed: int = 0
    """Seed of the environment: place on the road and grey of the target."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=NUMBER [...]", help_behavior_hint=_default_hint)] = ()
    """Scenario arguments in SI units, for example --set ego_speed=8.3 shade=40."""


@dataclass(frozen=True, kw_only=True)
class Video:
    """Watch video clips with the neuron: spike traces, figures, overlay videos, a detection table.

    For each clip the run folder gets trace.csv (one row per frame), trace.png and, if asked, overlay.mp4.
    """

    clips: Positional[tuple[str, ...]]
    """Video files, or folders of them; any file that ffmpeg reads."""
    choices: tuple[str, ...] = ("paper",)
    """Named ways to watch, compared in one table if several: paper, calm, paper-18hz, t_sf-60, t_sp-0.78,
    released, off-only, fixed-inhibition, yue-rind-2006; or all."""
    crashes: Path | None = None
    """CSV with the columns clip,crash_frame (empty for no crash): prints the detection table."""
    crash_frame: int | None = None
    """Crash frame of a single clip, 0-based: marked in the figure."""
    out: Path | None = None
    """Run folder; must not exist. Default: runs/video-DATE-TIME."""
    params: Path | None = None
    """TOML file of LGMD parameters, in place of the choice's."""
    threshold: float | None = None
    """Alarm level T_sf [spikes/s]; read it together with the frame rate."""
    fps: float | None = None
    """Resample to this rate [Hz]; the neuron's answer depends on it."""
    drop_duplicates: float | None = None
    """Hide frames that change by less than this fraction of the typical change, as 0.25; 0 shows all."""
    size: tuple[int, int] | None = None
    """Scale to this width and height [px]."""
    roi: tuple[int, int, int, int] | None = None
    """The neuron sees only this region: top left height width [px]."""
    overlay: bool = False
    """Write the overlay video: picture, excitation, spikes, alert lamp."""
    plots: bool = True
    """Draw the figures."""


@dataclass(frozen=True, kw_only=True)
class Paper:
    """Run every experiment of the paper; write the figures and a table of which claims hold.

    The crash and near-miss clips of the paper are not part of the package: give a folder of your own.
    """

    out: Path | None = None
    """Run folder; must not exist. Default: runs/paper-DATE-TIME."""
    clips: Path | None = None
    """Folder of driving clips; needs --crashes."""
    crashes: Path | None = None
    """CSV with the columns clip,crash_frame (empty for no crash)."""
    picture: Path | None = None
    """Picture for the shifting panorama; default: a random one with a natural spectrum."""


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train a policy with stable-baselines3; run it with --agents policy:FOLDER/policy.zip.

    The folder contains TensorBoard logs, checkpoints, the evaluations on the validation split and the policy
    that did best in them. Ctrl-C keeps the checkpoints; --resume continues from the last one.
    """

    algo: str = "sac"
    """Algorithm: sac, ppo, dqn, or offline (trained on recorded episodes in minutes)."""
    env: str = "LGMD/RandomBraking-v0"
    """Environment id; RandomBraking is trained on its split train and evaluated on its split validation."""
    camera: Names = None
    """Camera presets, one neuron each. Default: fovea tele wide."""
    sensors_of: Name = None
    """Agent whose cameras are used instead, for example stopping-zone."""
    inputs: Names = None
    """Policy inputs: spike_frequency, spike_peak, membrane_potential, ffi, ego_speed, speed_change and
    ego_yaw_rate; also frame, and with the cameras of stopping-zone zones, zones_spikes and zones_ffi.
    Default: from the hyperparameters."""
    demands: Annotated[
        tuple[float, ...] | None, arg(metavar="[X ...]", help_behavior_hint=_default_hint)
    ] = None
    """Demands that the policy chooses from, from -1 (full braking) to 1; --demands alone for a continuous
    demand. Default: 0 -0.4 -1 for ppo and dqn, continuous for sac, 0 -1 for offline."""
    n_timesteps: Count = None
    """Number of policy decisions, for offline of recorded episodes. Default: from the hyperparameters."""
    seed: int = 0
    """Seed of the network and the environments."""
    hyperparams: File = None
    """YAML file in rl-zoo's format. Default: the file of this package."""
    eval_freq: int = 20_000
    """Number of decisions between two evaluations; offline evaluates after every epoch."""
    eval_episodes: Count = None
    """Number of episodes per evaluation. Default: 60, for offline 600."""
    recordings: File = None
    """Folder of an offline training with the same cameras whose recorded episodes are reused."""
    traffic_episodes: int = 0
    """Number of traffic episodes, in which braking is false, that offline trains on in addition."""
    jobs: int = 2
    """Number of processes that record episodes."""
    out: File = None
    """Training folder; must not exist. Default: runs/train-ALGO-DATE-TIME."""
    resume: File = None
    """Folder of an interrupted training; continues it with its own options."""


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Tune a rule on training levels of LGMD/RandomBraking-v0 and false-reaction cases with other seeds.

    Validation levels choose among the best trials; test levels and the protocol suites stay unseen. What the
    rule's eye sees is recorded once, so that a trial takes seconds. With cameras, placing or neuron the eye
    itself is searched, too, and every trial has to see anew: about a minute. A rule that does not latch
    (graded) is played out, which takes minutes a trial.
    """

    agent: str = "stopping-zone"
    """Name of a rule."""
    cameras: tuple[str, ...] = ()
    """Camera presets to choose among, for a rule with one camera, as fovea tele wide."""
    placing: bool = False
    """Search also what places the rule's own cameras, as stopping-zone's deceleration and reaction."""
    neuron: tuple[str, ...] = ()
    """Parameters of the neuron to search, each from half to twice the paper's, as sigma_3 t_sp."""
    trials: int = 40
    """Trials to add to the study."""
    levels: int = 100
    """Levels of either split, from 0 on; half of them are threats."""
    seeds: int = 1
    """Seeds of the false-reaction suite, from 1000 on to search and from 2000 on to choose."""
    false_cost: float = 1.0
    """What a false brake costs, in contacts at full speed."""
    jobs: int = 2
    """Processes."""
    study: Path = Path("tune.db")
    """SQLite file of the study; one that exists is gone on with."""
    best: Path = Path("best.toml")
    """TOML file for the chosen parameters; must not exist. Those of the neuron go into BEST-neuron.toml."""
    sensitivity: bool = False
    """Do not search: shift each parameter by 20 % both ways and print the scores."""


@dataclass(frozen=True, kw_only=True)
class List:
    """List suites, agents, environments and cameras."""

    what: Positional[Literal["all", "suites", "agents", "envs", "cameras"]] = "all"
    """Table to print."""


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """Make a page of videos of every scenario, with what each agent makes of it; a few minutes.

    The page needs no network: open index.html in the folder.
    """

    out: Path = Path("gallery")
    """Folder; must not exist."""
    families: tuple[str, ...] = ()
    """Scenario families or kinds of traffic, as CCRs merge; none for all."""
    agent: str = "spike-threshold"
    """Who brakes in the videos."""
    seeds: int = 3
    """Seeds per scenario that the agents are judged by."""


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check package versions, numba's cache, the video codec and the display, and simulate for two seconds.

    The exit code is 1 if a check finds a fault; the output suggests a fix.
    """
