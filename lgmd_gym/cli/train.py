"""What `lgmd-gym train` does with its parsed options."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lgmd_gym.cli.options import Train


def train(options: "Train") -> int:
    """Train, and say where the policy is."""
    from lgmd_gym.agents.options import whole
    from lgmd_gym.training.config import Order
    from lgmd_gym.training.trainer import Training

    _check_installed()
    whole("jobs", options.jobs, 1)
    if options.resume is not None:
        training = Training.resume(options.resume)
    else:
        order = Order(
            algo=options.algo,
            env_id=options.env,
            camera=options.camera,
            eye=options.eye,
            steps=options.steps,
            seed=options.seed,
            hyperparams=options.hyperparams,
            inputs=options.inputs,
            demands=options.demands,
            eval_every=options.eval_every,
            eval_episodes=options.eval_episodes,
            drives=options.drives,
            traffic=options.traffic,
        )
        out = options.out or Path("runs") / f"train-{options.algo}-{time.strftime('%Y%m%d-%H%M%S')}"
        training = Training.start(order, out)
    try:
        policy = training.run(progress=sys.stderr.isatty(), jobs=options.jobs)
    except KeyboardInterrupt:
        print(f"interrupted; go on with: lgmd-gym train --resume {training.folder}", file=sys.stderr)
        return 130
    print(f"policy: {policy}")
    print(f"try it: lgmd-gym bench --suite random --seeds 1 --agents policy:{policy}")
    return 0


def _check_installed() -> None:
    """Refuse to start without the extra."""
    try:
        import stable_baselines3  # noqa: F401
        import yaml  # noqa: F401
    except ImportError as error:
        raise ValueError(
            f'training needs the extra "train" ({error}): pip install "lgmd-gym[train]"'
        ) from None
