"""`MonitorLog`: the episodes of a training run in `monitor.csv`, the format of SB3's `Monitor`."""

import csv
import json
from pathlib import Path
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import ResultsWriter

from lgmd_gym.processes.files import complete_file

FILE = "monitor.csv"
TIMESTEPS = "timesteps"
COLUMNS = ("r", "l", "t", TIMESTEPS)


class MonitorLog(BaseCallback):
    """Appends each training episode to a file: return `r`, decisions `l`, time `t` [s], and `timesteps`.

    The plotting functions of stable-baselines3 and rl-zoo read it: `load_results(folder)`. `timesteps` is the
    number of decisions of all environments at the end of the episode. A resumed training removes the episodes
    after its checkpoint, which are run again, and continues the time.

    Args:
        folder: Training folder.
        env_id: Environment id, for the header.
    """

    def __init__(self, folder: Path, env_id: str) -> None:
        super().__init__()
        self._path, self._env_id = folder / FILE, env_id
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

    def _rows_until(self, timesteps: int) -> list[dict[str, Any]]:
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
