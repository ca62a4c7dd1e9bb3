"""One training: environments, model, callbacks, and the policy file that comes out."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import lgmd_gym
from lgmd_gym.agents.policy import write_card
from lgmd_gym.errors import check_keys
from lgmd_gym.folders import new_folder
from lgmd_gym.training.orders import Order, Plan
from lgmd_gym.training.settings import arguments_of

PLAN = "plan.json"
SEEDS_APART = 1_000_000
JUDGED = 10_000  # seed of the levels that a look at the validation split plays
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

    def run(self, progress: bool = False) -> Path:
        """Train to the end and return the policy file: the model that did best on the validation split."""
        from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

        plan = self.plan
        envs = VecMonitor(DummyVecEnv([lambda: plan.make_env("train")] * plan.n_envs))
        judges = VecMonitor(DummyVecEnv([lambda: plan.make_env("validation")]))
        started = time.perf_counter()
        try:
            model = self._model(envs)
            # The constructor seeds environment i with seed + i: neighbouring trainings would drive the same
            # levels in three of four environments.
            envs.seed(SEEDS_APART * plan.seed + model.num_timesteps)
            left = plan.n_timesteps - model.num_timesteps
            if left > 0:
                model.learn(
                    left,
                    self._callbacks(judges),
                    reset_num_timesteps=False,
                    progress_bar=progress,
                    tb_log_name="log",
                )
            model.save(self.folder / "last.zip")
        finally:
            envs.close()
            judges.close()
        return self._finish(time.perf_counter() - started)

    def _model(self, envs: Any) -> Any:
        import stable_baselines3
        import torch

        torch.set_num_threads(1)
        algorithm = getattr(stable_baselines3, self.plan.algo.upper())
        newest = self._newest_checkpoint()
        if newest is not None:
            model = algorithm.load(newest, envs, device="cpu")
            buffer = newest.with_name(newest.name.replace("model_", "model_replay_buffer_")).with_suffix(
                ".pkl"
            )
            if buffer.exists():
                model.load_replay_buffer(buffer)
            return model
        return algorithm(
            self.plan.policy,
            envs,
            seed=self.plan.seed,
            device="cpu",
            tensorboard_log=str(self.folder / "tensorboard"),
            **arguments_of(self.plan.model),
        )

    def _newest_checkpoint(self) -> Path | None:
        found = self.folder.glob("checkpoints/model_*_steps.zip")
        return max(found, key=lambda path: int(path.stem.split("_")[-2]), default=None)

    def _callbacks(self, judges: Any) -> list[Any]:
        from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback

        class SameLevels(EvalCallback):
            """Judges on the same levels at every look, so that two looks can be compared."""

            def _on_step(self) -> bool:
                if self.eval_freq > 0 and self.n_calls % self.eval_freq == 0:
                    self.eval_env.seed(JUDGED)
                return super()._on_step()

        every = max(self.plan.eval_every // self.plan.n_envs, 1)
        return [
            CheckpointCallback(
                every, str(self.folder / "checkpoints"), "model", save_replay_buffer=self.plan.algo != "ppo"
            ),
            _carried_on(
                SameLevels(
                    judges,
                    eval_freq=every,
                    n_eval_episodes=self.plan.eval_episodes,
                    best_model_save_path=str(self.folder / "best"),
                    log_path=str(self.folder / "best"),
                    verbose=0,
                )
            ),
        ]

    def _finish(self, wall_time: float) -> Path:
        """Write the best model to `policy.zip`, with its card and without what only training needs."""
        import stable_baselines3

        best = self.folder / "best" / "best_model.zip"
        algorithm = getattr(stable_baselines3, self.plan.algo.upper())
        model = algorithm.load(best if best.exists() else self.folder / "last.zip", device="cpu")
        model.save(self.policy, exclude=TRAINING_ONLY)
        write_card(self.policy, self._card(wall_time))
        return self.policy

    def _card(self, wall_time: float) -> dict[str, Any]:
        plan = self.plan
        return {
            "lgmd_gym": lgmd_gym.__version__,
            "algo": plan.algo,
            "camera": plan.camera,
            "features": plan.features,
            "levels": plan.demands or None,
            "plan": plan.to_dict(),
            "wall_time": round(wall_time, 1),
        }


def _carried_on(looks: Any) -> Any:
    """Have looks at the validation split go on from those of a training that was broken off."""
    file = Path(looks.log_path).with_suffix(".npz")
    if file.exists():
        with np.load(file) as before:
            looks.evaluations_timesteps = before["timesteps"].tolist()
            looks.evaluations_results = before["results"].tolist()
            looks.evaluations_length = before["ep_lengths"].tolist()
            looks.best_mean_reward = float(before["results"].mean(axis=1).max())
    return looks
