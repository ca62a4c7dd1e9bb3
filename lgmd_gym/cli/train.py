"""The `train` command; the attribute docstrings of `Train` are its help texts."""

import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from lgmd_gym.cli.values import Count, File, Name, Names, default_out, read_camera, refuse_unused

if TYPE_CHECKING:
    from lgmd_gym.training import TrainConfig


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train a policy with stable-baselines3; run it with --agents policy:FOLDER/policy.zip.

    It prints the mean returns of training and validation as it goes. The folder contains TensorBoard logs,
    checkpoints, the evaluations on the validation split and the policy with the best mean return in them.
    Ctrl-C keeps the checkpoints; --resume continues from the last one.
    """

    algo: str = "dqn"
    """Algorithm: dqn, ppo, sac, or time-to-brake, which is trained on recorded episodes for a brake that
    warns, brakes and is released."""
    env: str = "LGMD/RandomBraking-v0"
    """Environment id; random levels and traffic are trained on the split train, evaluated on validation."""
    camera: Names = None
    """Camera presets or TOML files with the fields of cameras, one neuron each. Default: those that the
    inputs require, else fovea tele wide."""
    neuron: Name = None
    """Neuron model of cameras without their own, with options, or MODULE:FACTORY. Default: lgmd."""
    sensors_of: Name = None
    """Agent whose cameras are used instead, for example stopping-zone; all-round adds fields at the sides."""
    inputs: Names = None
    """Policy inputs: spike_frequency, spike_peak, membrane_potential, ffi, ego_speed, speed_change,
    ego_yaw_rate and ego_acceleration; also frame; with the cameras of stopping-zone, also zones, zones_spikes
    and zones_ffi; with those of all-round, also sides_ffi, columns and known_deceleration.
    Default: from the hyperparameters."""
    demands: Annotated[tuple[float, ...] | None, arg(metavar="[X ...]")] = None
    """Demands that the policy chooses from, from -1 (full braking) to 1; --demands alone for a continuous
    demand. Default: 0 -1; continuous for sac; none for time-to-brake."""
    n_timesteps: Count = None
    """Number of policy decisions; of recorded episodes for time-to-brake. Default: from the
    hyperparameters."""
    seed: int = 0
    """Seed of the network and the environments."""
    hyperparams: File = None
    """YAML file in rl-zoo's format. Default: the file of this package."""
    eval_freq: int = 16_000
    """Number of decisions between two evaluations; training on recordings evaluates after every epoch."""
    eval_episodes: Count = None
    """Number of episodes per evaluation. Default: 96; for training on recordings, 600."""
    recordings: File = None
    """Folder of a training run on recordings with the same cameras, to reuse its recorded episodes."""
    start: Name = None
    """Policy with the same inputs and cameras, or fewer fields ahead, whose network time-to-brake starts
    from: a file, or a name in this package such as all-round. Default: random weights."""
    traffic_episodes: Count = None
    """Number of traffic episodes that training on recordings uses in addition.
    Default: from the hyperparameters, else 0."""
    extra_levels: Annotated[tuple[str, ...] | None, arg(metavar="N:NAME[,NAME...] [...]")] = None
    """Levels of some scenario families that training on recordings uses in addition, for example 40:CPNA,CPFA
    1000:EmptyRoad. Default: from the hyperparameters, else none."""
    error_levels: Annotated[tuple[str, ...] | None, arg(metavar="N:NAME[,NAME...] [...]")] = None
    """Levels as those of --extra-levels, but with errors of the sensor that no calibration finds.
    Default: from the hyperparameters, else none."""
    extra_traffic: Annotated[tuple[str, ...] | None, arg(metavar="N:KIND[,KIND...] [...]")] = None
    """Traffic episodes of some kinds that training on recordings uses in addition, for example
    2000:intersection,roundabout, or 400:inattentive-highway with drivers who err. Default: from the
    hyperparameters, else none."""
    jobs: int = 2
    """Number of processes that record episodes, and of threads that train an ensemble."""
    out: File = None
    """Training folder; must not exist. Default: runs/train-ALGO-DATE-TIME."""
    resume: File = None
    """Folder of an interrupted training run, to continue it with its own options."""


def run(options: Train) -> int:
    """Train a policy, or resume a training run, and print the path of the policy."""
    if options.resume is not None:
        refuse_unused(options, ("resume", "jobs"))
    _check_installed()  # the modules below require the extra

    from lgmd_gym.engine.first_use import compile_kernels
    from lgmd_gym.training import resume, train

    folder = options.resume or default_out(options.out, f"train-{options.algo}")
    config = None if options.resume is not None else config_of(options)
    try:
        compile_kernels()
        if config is None:
            policy = resume(folder, progress=True, jobs=options.jobs)
        else:
            policy = train(config, folder, progress=True, jobs=options.jobs)
    except KeyboardInterrupt:
        print(f"interrupted; {_what_is_kept(folder)}", file=sys.stderr)
        return 130
    print(f"policy: {policy}")
    print(f"evaluate it: lgmd-gym bench --suite random --seeds 1 --agents policy:{policy}")
    return 0


def _what_is_kept(folder: Path) -> str:
    """Return what an interrupted training has saved, and how to go on."""
    if not folder.exists():
        return "nothing was saved"
    resume = f"lgmd-gym train --resume {folder}"
    if any(folder.glob("checkpoints/model_*_steps.zip")) or any(folder.glob("episodes/*/*.npz")):
        return f"to resume: {resume}"
    return f"nothing was saved before the first checkpoint; to start again: {resume}"


def _check_installed() -> None:
    from lgmd_gym.processes.extras import missing_extra

    if not all(map(find_spec, ("stable_baselines3", "tensorboard", "yaml"))):
        raise missing_extra("training", "train")


def config_of(options: Train) -> "TrainConfig":
    """Return the configuration of the options of the command line."""
    from lgmd_gym.training import TrainConfig

    given = map(read_camera, options.camera or ())
    cameras = [item for camera in given for item in (camera if isinstance(camera, list) else [camera])]
    config = TrainConfig.from_hyperparams(
        options.algo,
        options.env,
        options.hyperparams,
        inputs=options.inputs or (),
        sensors_of=options.sensors_of,
        camera=(cameras if len(cameras) > 1 else cameras[0]) if cameras else None,
        demands=options.demands,
        n_timesteps=options.n_timesteps,
        seed=options.seed,
        eval_freq=options.eval_freq,
        eval_episodes=options.eval_episodes,
        recordings=None if options.recordings is None else str(options.recordings.resolve()),
        start=None if options.start is None else _policy_file(options.start),
        traffic_episodes=options.traffic_episodes,
        extra_levels=options.extra_levels,
        error_levels=options.error_levels,
        extra_traffic=options.extra_traffic,
    )
    return config if options.neuron is None else config.with_neuron(options.neuron)


def _policy_file(text: str) -> str:
    """Return the path of a policy: a name in this package, a file, or one after "policy:" as for agents."""
    from lgmd_gym.agents.policies.policy import find_policy

    return str(find_policy(text.removeprefix("policy:")).resolve())
