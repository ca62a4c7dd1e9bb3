"""Learning by driving, with stable-baselines3's own algorithms: environments, callbacks, checkpoints."""

from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.training.config import JUDGED, SEEDS_APART, Plan
from lgmd_gym.training.hyperparameters import arguments_of


def learn_online(plan: Plan, folder: Path, progress: bool) -> Any:
    """Train to the end, from the last checkpoint in the folder if there is one.

    Returns:
        The model that did best on the validation split.
    """
    import stable_baselines3
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

    envs = VecMonitor(DummyVecEnv([lambda: plan.make_env("train")] * plan.n_envs))
    judges = VecMonitor(DummyVecEnv([lambda: plan.make_env("validation")]))
    try:
        model = _model(plan, folder, envs)
        # The constructor seeds environment i with seed + i: neighbouring trainings would drive the same
        # levels in three of four environments.
        envs.seed(SEEDS_APART * plan.seed + model.num_timesteps)
        left = plan.n_timesteps - model.num_timesteps
        if left > 0:
            model.learn(
                left,
                _callbacks(plan, folder, judges),
                reset_num_timesteps=False,
                progress_bar=progress,
                tb_log_name="log",
            )
        model.save(folder / "last.zip")
    finally:
        envs.close()
        judges.close()
    best = folder / "best" / "best_model.zip"
    algorithm = getattr(stable_baselines3, plan.algo.upper())
    return algorithm.load(best if best.exists() else folder / "last.zip", device="cpu")


def _model(plan: Plan, folder: Path, envs: Any) -> Any:
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    algorithm = getattr(stable_baselines3, plan.algo.upper())
    newest = newest_checkpoint(folder)
    if newest is not None:
        model = algorithm.load(newest, envs, device="cpu")
        name = newest.name.replace("model_", "model_replay_buffer_")
        buffer = newest.with_name(name).with_suffix(".pkl")
        if buffer.exists():
            model.load_replay_buffer(buffer)
        return model
    return algorithm(
        plan.policy,
        envs,
        seed=plan.seed,
        device="cpu",
        tensorboard_log=str(folder / "tensorboard"),
        **arguments_of(plan.model),
    )


def newest_checkpoint(folder: Path) -> Path | None:
    """Return the last model that a training in a folder has saved, or None."""
    found = folder.glob("checkpoints/model_*_steps.zip")
    return max(found, key=lambda path: int(path.stem.split("_")[-2]), default=None)


def _callbacks(plan: Plan, folder: Path, judges: Any) -> list[Any]:
    from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback

    class SameLevels(EvalCallback):
        """Judges on the same levels at every look, so that two looks can be compared."""

        def _on_step(self) -> bool:
            if self.eval_freq > 0 and self.n_calls % self.eval_freq == 0:
                self.eval_env.seed(JUDGED)
            return super()._on_step()

    every = max(plan.eval_every // plan.n_envs, 1)
    looks = SameLevels(
        judges,
        eval_freq=every,
        n_eval_episodes=plan.eval_episodes,
        best_model_save_path=str(folder / "best"),
        log_path=str(folder / "best"),
        verbose=0,
    )
    kept = str(folder / "checkpoints")
    return [
        CheckpointCallback(every, kept, "model", save_replay_buffer=plan.algo != "ppo"),
        _carried_on(looks),
    ]


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
