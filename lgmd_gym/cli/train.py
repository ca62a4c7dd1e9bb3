"""The `train` command."""

import sys
import time
from importlib.util import find_spec
from pathlib import Path

from lgmd_gym.cli.options import Train, refuse_unused
from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.training import TrainConfig, resume, train


def run(options: Train) -> int:
    """Train a policy, or resume a training run, and print the path of the policy."""
    if options.resume is not None:
        refuse_unused(options, "--resume", ("resume", "jobs"))
    _check_installed()
    folder = options.resume or options.out or _default_folder(options.algo)
    progress = sys.stderr.isatty()
    try:
        if options.resume is not None:
            policy = resume(folder, progress=progress, jobs=options.jobs)
        else:
            policy = train(config_of(options), folder, progress=progress, jobs=options.jobs)
    except KeyboardInterrupt:
        print(f"interrupted; to resume: lgmd-gym train --resume {folder}", file=sys.stderr)
        return 130
    print(f"policy: {policy}")
    print(f"evaluate it: lgmd-gym bench --suite random --seeds 1 --agents policy:{policy}")
    return 0


def _check_installed() -> None:
    if not all(map(find_spec, ("stable_baselines3", "tensorboard", "yaml"))):
        raise missing_extra("training", "train")


def config_of(options: Train) -> TrainConfig:
    """Return the configuration of the options of the command line."""
    cameras = list(options.camera or ())
    return TrainConfig.from_hyperparams(
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
        traffic_episodes=options.traffic_episodes,
        extra_levels=options.extra_levels,
        extra_traffic=options.extra_traffic,
        videos=options.videos,
        wandb=options.wandb,
    )


def _default_folder(algo: str) -> Path:
    return Path("runs") / f"train-{algo}-{time.strftime('%Y%m%d-%H%M%S')}"
