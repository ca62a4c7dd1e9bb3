"""What all runs share: rows are kept as they come, and whatever breaks a run off loses none of them."""

import contextlib
import time
from collections.abc import Callable
from typing import Any

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.executor import PoolLostError
from lgmd_gym.benchmark.folder import RunFolder

Row = dict[str, Any]
INTERRUPTED = "interrupted"


class Session:
    """A run that can be played; `Run` and `TrafficRun` say what.

    Args:
        config: What is played.
        folder: Where rows go.
        rows: Those it holds already.
        jobs: Processes.
        cluster: Address of a Dask scheduler, or None.

    Attributes:
        stopped: Why the last `play` broke off; "" if it did not.
    """

    def __init__(
        self, config: RunConfig, folder: RunFolder, rows: list[Row], jobs: int, cluster: str | None
    ) -> None:
        self.config, self.folder, self.rows, self.jobs, self.cluster = config, folder, rows, jobs, cluster
        self.suite, self.agents, self.seeds = config.suite, list(config.agents), config.seeds
        self.sensor_config = config.sensor_config
        self.stopped = ""

    @property
    def total(self) -> int:
        """Number of episodes that will be played."""
        raise NotImplementedError

    def _play(self, keep: Callable[[Row], None]) -> None:
        """Play what is missing; give each row to `keep` as it comes."""
        raise NotImplementedError

    def play(self, progress: Callable[[Row], None] | None = None) -> bool:
        """Play everything; every finished row is on disk, whatever breaks it off.

        Args:
            progress: Called with each row as it finishes.

        Returns:
            Whether all was played; if not, `stopped` says why.
        """

        def keep(row: Row) -> None:
            self.folder.add(row)
            self.rows.append(row)
            if progress is not None:
                progress(row)

        started, complete, self.stopped = time.perf_counter(), False, ""
        try:
            self._describe(False, 0.0)
            self._play(keep)
            complete = True
        except KeyboardInterrupt:
            self.stopped = INTERRUPTED
        except PoolLostError as error:
            self.stopped = str(error)
        except OSError as error:
            self.stopped = f"{error.strerror or error} in run folder {str(self.folder.path)!r}"
        finally:
            with contextlib.suppress(OSError):  # of a full disk
                self._describe(complete, time.perf_counter() - started)
            self.folder.close()
        return complete

    def _more_settings(self) -> dict[str, Any]:
        """Return what `run.json` says beside the config."""
        return {}

    def _describe(self, complete: bool, wall_time: float) -> None:
        """Write `run.json`."""
        config = self.config
        self.folder.describe(
            {
                "suite": config.suite,
                "agents": list(config.agents),
                "seeds": config.seeds,
                "first_seed": config.first_seed,
                "conditions": list(config.conditions),
                "camera": config.camera,
                "params": config.params,
                "jobs": self.jobs,
                "cluster": self.cluster,
                **self._more_settings(),
                "complete": complete,
                "episodes": len(self.rows),
                "wall_time": round(wall_time, 3),
            }
        )
