"""Suites of cases, episodes played in parallel, rows, and what they sum up to."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


def run(
    suite: str,
    agents: Iterable[str],
    seeds: int = 3,
    jobs: int = 1,
    out: Path | str | None = None,
    camera: Any = None,
    params: Any = None,
    conditions: Iterable[str] = ("clear",),
    cluster: str | None = None,
    first_seed: int = 0,
) -> "pd.DataFrame":
    """Play a suite and return its rows.

    Args:
        suite: Name of a suite, the path of a suite file (".toml"), or "traffic".
        agents: Agent strings, such as "spike-threshold:threshold=45" or "my_module:MyAgent".
        seeds: Number of seeds.
        jobs: Processes; 1 plays in this one.
        out: Run folder to keep, which must not exist; None keeps none.
        camera: See `LGMDObservation`; None for each agent's own, see `Agent.camera`.
        params: See `LGMDObservation`.
        conditions: Camera conditions by name, such as "clear" and "degraded"; the suite is played under each.
        cluster: Address of a Dask scheduler to play on, in place of processes.
        first_seed: Seeds are played from this one on.

    Returns:
        One line per episode with the columns of `lgmd_gym.benchmark.rows.KEYS`, `no-brake` included; for
        "traffic", those of `traffic_rows.KEYS`.

    Raises:
        ValueError: For an unknown name, a count below 1, a cluster that does not answer, or a folder that
            exists or cannot be made.
        RuntimeError: If the run broke off: a worker was killed, or the disk is full.
    """
    from tempfile import TemporaryDirectory

    import pandas as pd

    from lgmd_gym.benchmark.runs import start_run
    from lgmd_gym.benchmark.sensors import SensorConfig

    with TemporaryDirectory() as spare:
        folder = Path(out or Path(spare) / "run")
        sensor_config = SensorConfig(camera, params)
        played = start_run(suite, agents, seeds, jobs, folder, sensor_config, conditions, cluster, first_seed)
        if not played.play():
            raise RuntimeError(f"{played.stopped}: {len(played.rows)} of {played.total} episodes kept")
        return pd.DataFrame(played.rows)
