"""Options of `compare`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from lgmd_gym.cli.options.values import File, Names, SecondFile


@dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare agents in pairs, or several training runs as arms, on the same episodes.

    Pairs: differences B − A over episodes of the same case, seed and condition, with 95 % intervals from a
    bootstrap over cases. Arms: mean return and shares of each arm, and the difference to the first arm. Arms
    need one run of all agents: lgmd-gym bench --suite random --agents policy:a0.zip policy:a1.zip ttc-oracle.
    """

    run_a: Positional[Path]
    """Run folder of A."""
    run_b: Positional[SecondFile] = None
    """Run folder of B. Default: compare agents within the first run."""
    agents: Names = None
    """Agent of A and agent of B. Default: every agent of both runs, or all pairs within one run."""
    arms: Names = None
    """Arms of the first run, each NAME=AGENT,AGENT,... (wildcards allowed, for example lgmd=policy:*lgmd*) or
    a single agent. --arms without names makes every agent an arm."""
    out: File = None
    """PNG or SVG file for the figure of the paired differences; must not exist."""
