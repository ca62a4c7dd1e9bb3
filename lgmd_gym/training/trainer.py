"""One training in a folder: its plan, and the policy file that comes out."""

import json
import time
from pathlib import Path
from typing import Any

import lgmd_gym
from lgmd_gym.agents.policies.policy import write_card
from lgmd_gym.benchmark.new_folder import new_folder
from lgmd_gym.errors import check_keys
from lgmd_gym.training.config import Order, Plan
from lgmd_gym.training.hyperparameters import RECORDED
from lgmd_gym.training.offline.splits import check_drives

PLAN = "plan.json"
# Of a saved model: where it logged, and the episodes it was in.
TRAINING_ONLY = (
    "tensorboard_log",
    "ep_info_buffer",
    "ep_success_buffer",
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
)


class Training:
    """One training in a folder, new or resumed.

    Args:
        plan: What is trained.
        folder: Where; made by `start`, read by `resume`.
    """

    def __init__(self, plan: Plan, folder: Path) -> None:
        self.plan, self.folder = plan, folder

    @classmethod
    def start(cls, order: Order, folder: Path) -> "Training":
        """Begin a new one.

        Raises:
            ValueError: For anything in the order that cannot be, or a folder that exists or cannot be made;
                before anything is trained.
        """
        plan = order.plan()
        plan.make_env("train").close()
        check_drives(plan)
        new_folder(folder, "training folder")
        (folder / PLAN).write_text(json.dumps(plan.to_dict(), indent=2) + "\n", encoding="utf-8")
        return cls(plan, folder)

    @classmethod
    def resume(cls, folder: Path) -> "Training":
        """Go on with one that was broken off, from its last checkpoint and by its own plan.

        Raises:
            ValueError: If the folder holds no training.
        """
        try:
            plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            raise ValueError(f"{str(folder)!r} holds no training to resume (no {PLAN})") from None
        check_keys(f"key of {PLAN}", plan, Plan.__dataclass_fields__)
        return cls(Plan(**plan), folder)

    @property
    def policy(self) -> Path:
        """The policy file that comes out."""
        return self.folder / "policy.zip"

    def run(self, progress: bool = False, jobs: int = 1) -> Path:
        """Train to the end and return the policy file: the model that did best on the validation split.

        Args:
            progress: Whether to show it on stderr.
            jobs: Processes that record drives.
        """
        started = time.perf_counter()
        if self.plan.algo == RECORDED:
            from lgmd_gym.training.offline.train import learn_recorded

            model, algo = learn_recorded(self.plan, self.folder, progress, jobs), "ppo"
        else:
            from lgmd_gym.training.online import learn_online

            model, algo = learn_online(self.plan, self.folder, progress), self.plan.algo
        model.save(self.policy, exclude=TRAINING_ONLY)
        write_card(self.policy, self._card(algo, time.perf_counter() - started))
        return self.policy

    def _card(self, algo: str, wall_time: float) -> dict[str, Any]:
        plan = self.plan
        return {
            "lgmd_gym": lgmd_gym.__version__,
            "algo": algo,  # of stable-baselines3, which reads the file
            "camera": plan.camera,
            "features": plan.features,
            "demands": plan.demands or None,
            "config": {**plan.to_dict(), "drives": None},  # a path on the machine it was trained on
            "wall_time": round(wall_time, 1),
        }
