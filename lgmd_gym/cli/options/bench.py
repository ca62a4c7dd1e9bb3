"""Options of `bench`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from typing import Literal

from lgmd_gym.cli.options.values import Count, File, Name, Names


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Run agents on a suite, print the scores and write a run folder.

    The folder contains episodes.jsonl (one row per episode, written as it finishes), episodes.csv,
    summary.csv, report.html with its figures, run.toml, run.json, time series and one PNG per case. Ctrl-C
    keeps the finished episodes.
    """

    suite: Names = None
    """Suite name (see `lgmd-gym list suites`), or paths: suite or scenario files (.toml, .json), OpenSCENARIO
    files (.xosc), folders with such files. Default: quick."""
    agents: Names = None
    """Agents with options, for example spike-threshold:threshold=45,frames=2; MODULE:CLASS for an agent of
    your own. Default: no-brake always-brake random-brake spike-threshold stopping-zone ttc-oracle."""
    seeds: Count = None
    """Number of seeds per case; a seed sets the start position and the target's grey level. Default: 3."""
    first_seed: Count = None
    """First seed. Default: 0."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    conditions: Names = None
    """Camera conditions, each run separately: clear, night, night_upper_beam, fog, rain, low_sun, or mixed
    for that of each world. Default: clear."""
    worlds: Count = None
    """Number of worlds (asphalt, light, surroundings, brake); 0 for the plain laboratory. Default: 20."""
    first_world: Count = None
    """First world; 8000 to 8999 are the test worlds. Default: 8000."""
    road: Name = None
    """Road under the car: still, smooth, normal or rough. Default: normal, in the laboratory still."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    config: File = None
    """run.toml of an earlier run to repeat; replaces the options above."""
    resume: File = None
    """Folder of an interrupted run; runs the missing episodes with the settings of that run."""
    trust: bool = False
    """Load modules and policy files that --resume, --config or the suite file names; they can run any
    code."""
    jobs: int = 2
    """Number of processes."""
    backend: Literal["processes", "dask"] = "processes"
    """Executor: local processes or a running Dask cluster."""
    address: Name = None
    """Address of the Dask scheduler, for example tcp://10.0.0.1:8786."""
    out: File = None
    """Run folder; must not exist. Default: runs/SUITE-DATE-TIME."""
    plots: bool = True
    """Draw one PNG per case."""
    report: bool = True
    """Write report.html."""
