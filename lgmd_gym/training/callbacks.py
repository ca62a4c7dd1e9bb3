# pyright: standard
# Not strict: Gymnasium and stable-baselines3 state few types.
"""Checkpoints, evaluations and the episode log of an online training run, complete after a kill."""

import csv
import json
import pickle
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import ResultsWriter

from lgmd_gym.aliases import Values
from lgmd_gym.processes.files import complete_file, is_intact_zip
from lgmd_gym.training.config import VALIDATION_SEED

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
    from stable_baselines3.common.vec_env import VecEnv

    from lgmd_gym.training.returns import Show

DATA = "data"  # member of every model file of stable-baselines3
DAMAGED = (  # raised by pickle for a file that is missing, truncated or damaged
    OSError, EOFError, pickle.UnpicklingError, ValueError, AttributeError, ImportError, IndexError, KeyError
)  # fmt: skip


def save_model(model: "BaseAlgorithm", path: Path, **options: Any) -> None:
    """Save a model; a kill leaves the old file or the new one."""
    with complete_file(path) as part:
        model.save(part, **options)


def checkpoints_of(folder: Path) -> list[Path]:
    """Return the model files of the checkpoints in a training folder, newest first."""
    found = folder.glob("checkpoints/model_*_steps.zip")
    return sorted(found, key=lambda path: int(path.stem.split("_")[-2]), reverse=True)


def load_checkpoint(algorithm: "type[BaseAlgorithm]", folder: Path, envs: "VecEnv") -> Any:
    """Return the model of the newest checkpoint that opens, or None; print which ones do not open."""
    for path in checkpoints_of(folder):
        if is_intact_zip(path, DATA):
            model: Any = algorithm.load(path, envs, device="cpu")
            if not hasattr(model, "replay_buffer") or _load_buffer(model, _buffer_file(path)):
                return model
        note(f"checkpoint {str(path)!r} is damaged; training resumes from an earlier state")
    return None


def _load_buffer(model: "OffPolicyAlgorithm", path: Path) -> bool:
    try:
        model.load_replay_buffer(path)
    except DAMAGED:
        return False
    return True


def _buffer_file(path: Path) -> Path:
    return path.with_name(path.name.replace("model_", "model_replay_buffer_")).with_suffix(".pkl")


class CheckpointSaver(BaseCallback):
    """Saves the model, and its replay buffer if it has one, every `frequency` calls."""

    def __init__(self, folder: Path, frequency: int) -> None:
        super().__init__()
        self._folder, self._frequency = folder, frequency

    def _on_step(self) -> bool:
        if self.n_calls % self._frequency == 0:
            path = self._folder / "checkpoints" / f"model_{self.num_timesteps}_steps.zip"
            model: Any = self.model
            if getattr(model, "replay_buffer", None) is not None:
                with complete_file(_buffer_file(path)) as part:
                    model.save_replay_buffer(part)
            save_model(model, path)  # last: a checkpoint with a model file is complete
        return True


class Evaluator(EvalCallback):
    """Evaluates on the same levels every time, so that evaluations are comparable.

    Attributes:
        show: Shows the number of decisions and what the training does, for example in a progress bar.
    """

    show: "Show | None" = None

    def __init__(self, envs: "VecEnv", folder: Path, frequency: int, episodes: int) -> None:
        self._best, self._unfinished = folder / "best", folder / "best" / "unfinished"
        written = str(self._unfinished)  # the base class writes in place
        super().__init__(
            envs, None, None, episodes, frequency, log_path=written, best_model_save_path=written, verbose=0
        )

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq:
            return True
        if self.show is not None:
            self.show(self.num_timesteps, "evaluating")
        self.eval_env.seed(VALIDATION_SEED)
        proceed = super()._on_step()
        for name in ("best_model.zip", "evaluations.npz"):
            if (self._unfinished / name).exists():
                with complete_file(self._best / name) as part:
                    (self._unfinished / name).replace(part)
        return proceed

    def _on_training_end(self) -> None:
        shutil.rmtree(self._unfinished, ignore_errors=True)

    def restore(self, model: "BaseAlgorithm") -> None:
        """Load the evaluations up to the state of `model`; only a better model then replaces the best one."""
        shutil.rmtree(self._unfinished, ignore_errors=True)
        file, best = self._best / "evaluations.npz", self._best / "best_model.zip"
        if is_intact_zip(file, "timesteps.npy"):
            with np.load(file) as log:
                kept = log["timesteps"] <= model.num_timesteps
                self.evaluations_timesteps = log["timesteps"][kept].tolist()
                self.evaluations_results = log["results"][kept].tolist()
                self.evaluations_length = log["ep_lengths"][kept].tolist()
        elif file.exists():
            note(f"{str(file)!r} is damaged; its earlier evaluations are lost")
        if is_intact_zip(best, DATA):
            # The file of evaluations may lack the best one, or contain one whose model was not saved.
            self.eval_env.seed(VALIDATION_SEED)
            returns, _ = evaluate_policy(
                type(model).load(best, device="cpu"), self.eval_env, self.n_eval_episodes
            )
            self.best_mean_reward = float(np.mean(returns))
        elif best.exists():
            note(f"best model {str(best)!r} is damaged; the next evaluation replaces it")


def best_model(algorithm: "type[BaseAlgorithm]", folder: Path) -> "BaseAlgorithm":
    """Return the model with the best evaluation, or the last model if there was no evaluation."""
    best = folder / "best" / "best_model.zip"
    if is_intact_zip(best, DATA):
        return algorithm.load(best, device="cpu")
    if best.exists():
        note(f"best model {str(best)!r} is damaged; the policy is the last model")
    return algorithm.load(folder / "last.zip", device="cpu")


def note(text: str) -> None:
    """Print a line to stderr."""
    print(f"lgmd-gym: {text}", file=sys.stderr)


MONITOR_FILE = "monitor.csv"
TIMESTEPS = "timesteps"
COLUMNS = ("r", "l", "t", TIMESTEPS)


class MonitorLog(BaseCallback):
    """Appends each training episode to a file: return `r`, decisions `l`, time `t` [s], and `timesteps`.

    The plotting functions of stable-baselines3 and rl-zoo read it: `load_results(folder)`. `timesteps` is the
    number of decisions of all environments at the end of the episode. A resumed training removes the episodes
    after its checkpoint, which are run again, and continues the time.
    """

    def __init__(self, folder: Path, env_id: str) -> None:
        super().__init__()
        self._path, self._env_id = folder / MONITOR_FILE, env_id
        self._elapsed = 0.0  # of the parts before a resumption [s]

    def _on_training_start(self) -> None:
        rows = self._rows_until(self.model.num_timesteps)
        self._elapsed = max((float(row["t"]) for row in rows), default=0.0)
        header: dict[str, float | str] = {"t_start": 0.0, "env_id": self._env_id}
        with complete_file(self._path) as part, part.open("w", encoding="utf-8", newline="\n") as out:
            out.write(f"#{json.dumps(header)}\n")
            writer: csv.DictWriter[str] = csv.DictWriter(out, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        self._writer = ResultsWriter(str(self._path), extra_keys=(TIMESTEPS,), override_existing=False)

    def _rows_until(self, timesteps: int) -> list[Values]:
        if not self._path.exists():
            return []
        with self._path.open(encoding="utf-8") as file:
            file.readline()
            return [
                row for row in csv.DictReader(file) if row[TIMESTEPS] and int(row[TIMESTEPS]) <= timesteps
            ]

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                row = info["episode"]
                values: dict[str, float] = {
                    "r": round(float(row["r"]), 6),
                    "l": int(row["l"]),
                    "t": round(self._elapsed + row["t"], 6),
                    TIMESTEPS: self.num_timesteps,
                }
                self._writer.write_row(values)
        return True

    def _on_training_end(self) -> None:
        self._writer.close()
