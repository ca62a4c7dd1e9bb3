"""`EpisodeLog`: the episodes of a training run in `monitor.csv`, the format of SB3's `Monitor`."""

from pathlib import Path

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import ResultsWriter

FILE = "monitor.csv"


class EpisodeLog(BaseCallback):
    """Appends the return `r`, the decisions `l` and the time `t` [s] of each training episode to a file.

    The plotting functions of stable-baselines3 and rl-zoo read it: `load_results(folder)`.

    Args:
        folder: Training folder.
        env_id: Environment id, for the header.
    """

    def __init__(self, folder: Path, env_id: str) -> None:
        super().__init__()
        self._path, self._env_id = folder / FILE, env_id

    def _on_training_start(self) -> None:
        header: dict[str, float | str] = {"t_start": 0.0, "env_id": self._env_id}
        self._writer = ResultsWriter(str(self._path), header, override_existing=not self._path.exists())

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                row = info["episode"]
                self._writer.write_row({"r": round(float(row["r"]), 6), "l": int(row["l"]), "t": row["t"]})
        return True

    def _on_training_end(self) -> None:
        self._writer.close()
