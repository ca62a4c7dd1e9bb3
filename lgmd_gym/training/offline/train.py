"""Learning from recorded drives, from recording to the model that does best."""

from pathlib import Path
from typing import Any

from lgmd_gym.training.config import Plan
from lgmd_gym.training.offline.learner import Learner
from lgmd_gym.training.offline.splits import drives_of


def learn_recorded(plan: Plan, folder: Path, progress: bool, jobs: int) -> Any:
    """Record drives unless they are there already, learn from them, and log every pass in the folder.

    Returns:
        The model that did best on the drives of the validation split.
    """
    from stable_baselines3.common.logger import configure
    from tqdm import tqdm

    drives, judges = (drives_of(plan, split, folder, progress, jobs) for split in ("train", "validation"))
    learner = Learner(plan, drives, judges, pieces=len(judges) - plan.eval_episodes)
    logger = configure(str(folder / "log"), ["csv", "tensorboard"])
    try:
        with tqdm(total=learner.recipe.n_epochs, desc="learning", unit="pass", disable=not progress) as bar:

            def log(number: int, reached: dict[str, float]) -> None:
                for name, value in reached.items():
                    logger.record(name, value)
                logger.dump(number)
                bar.set_postfix({name: f"{value:.2f}" for name, value in reached.items()})
                bar.update()

            return learner.learn(log)
    finally:
        logger.close()
