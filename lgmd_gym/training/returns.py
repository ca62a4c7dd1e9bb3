# pyright: standard
# Not strict: stable-baselines3 states few types.
"""The mean returns that a training prints while it runs, and its progress bar."""

import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from lgmd_gym.errors import counted
from lgmd_gym.training.config import TrainConfig

if TYPE_CHECKING:
    from lgmd_gym.training.callbacks import Evaluator

ROWS = 20  # of training returns in a whole run
HEADINGS = ("decisions", "training return", "validation return", "decisions/s")

Show = Callable[[int, str], None]
"""Shows the number of decisions and an activity."""


@contextmanager
def progress_bar(total: int) -> Generator[Show, None, None]:
    """Show a bar of decisions on stderr if it is a terminal; yield the function that moves it.

    Lines that are printed meanwhile stay above the bar.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, activity: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, redirect_stdout=sys.stdout.isatty()) as bar:
        task = bar.add_task("training", total=total)
        yield lambda done, activity: bar.update(task, completed=min(done, total), description=activity)


class ReturnTable(BaseCallback):
    """Prints a row at every evaluation, and one after every 5 % of the decisions of a run.

    The training return is the mean of the last 100 episodes, with exploration, in the scale of the
    environment; the validation return is the mean of an evaluation. It must follow the evaluator in the list
    of callbacks.

    Args:
        config: Configuration of the training.
        evaluator: Callback that evaluates.
        show: Moves the progress bar.
    """

    def __init__(self, config: TrainConfig, evaluator: "Evaluator", show: Show) -> None:
        super().__init__()
        self._config, self._evaluator, self._show = config, evaluator, show
        self._interval = max(config.n_timesteps // ROWS, 1)

    def _on_training_start(self) -> None:
        config = self._config
        self._started, self._first = time.perf_counter(), self.num_timesteps
        self._printed, self._evaluated = self.num_timesteps, len(self._evaluator.evaluations_timesteps)
        print(
            f"{config.algo} in {counted(config.n_envs, 'environment')} {config.env_id}: "
            f"{config.n_timesteps:,} decisions,"
            + (f" from {self._first:,} on," if self._first else "")
            + f" an evaluation of {counted(config.eval_episodes, 'episode')} every {config.eval_freq:,}"
        )
        print("  ".join(HEADINGS), flush=True)

    def _on_step(self) -> bool:
        evaluated = len(self._evaluator.evaluations_timesteps)
        if evaluated > self._evaluated or self.num_timesteps - self._printed >= self._interval:
            self._print_row(evaluated > self._evaluated)
            self._printed, self._evaluated = self.num_timesteps, evaluated
        self._show(self.num_timesteps, "training")
        return True

    def _print_row(self, evaluated: bool) -> None:
        episodes = self.model.ep_info_buffer or ()
        scale = self._config.features.reward_scale
        training = f"{np.mean([row['r'] for row in episodes]) / scale:.2f}" if episodes else "-"
        rate = (self.num_timesteps - self._first) / max(time.perf_counter() - self._started, 1e-9)
        last, best = self._evaluator.last_mean_reward, self._evaluator.best_mean_reward
        validation = f"{last:.2f}" if evaluated else ""
        cells = (f"{self.num_timesteps:,}", training, validation, f"{rate:.0f}")
        text = "  ".join(cell.rjust(len(name)) for cell, name in zip(cells, HEADINGS, strict=True))
        print(text + ("  best so far" if evaluated and last == best else ""), flush=True)
