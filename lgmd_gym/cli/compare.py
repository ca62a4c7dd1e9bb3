"""The `compare` command; the attribute docstrings of `Compare` are its help texts."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import File, Names


@dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare agents in pairs, or several training runs as arms, on the same episodes.

    Pairs: differences B − A over episodes of the same case, seed and condition, with 95 % intervals from a
    bootstrap over cases. Arms: mean return and shares of each arm, and the difference to the first arm. Arms
    need one run of all agents: lgmd-gym bench --suite random --agents policy:a0.zip policy:a1.zip ttc-oracle.
    """

    run_a: Positional[Path]
    """Run folder of A."""
    run_b: Annotated[Positional[Path | None], arg(metavar="[PATH]")] = None
    """Run folder of B. Default: compare agents within the first run."""
    agents: Names = None
    """Agent of A and agent of B. Default: every agent of both runs, or all pairs within one run."""
    arms: Names = None
    """Arms of the first run, each NAME=AGENT,AGENT,... (wildcards allowed, for example lgmd=policy:*lgmd*) or
    a single agent. --arms without names makes every agent an arm."""
    out: File = None
    """PNG or SVG file for the figure of the paired differences; must not exist."""


def run(options: Compare) -> int:
    """Print the paired differences of agents, or the results of arms."""
    if options.arms is None:
        _compare_pairs(options, make_console())
    else:
        _compare_arms(options, options.arms, make_console())
    return 0


def _compare_pairs(options: Compare, console: Console) -> None:
    from lgmd_gym.benchmark.analysis.compare import compare_runs, comparison_table, difference_figure
    from lgmd_gym.processes.files import check_new_file

    if options.out is not None:
        check_new_file(options.out, "--out")
    comparisons = compare_runs(options.run_a, options.run_b, options.agents)
    for comparison in comparisons:
        console.print(comparison_table(comparison))
    if options.out is not None:
        difference_figure(options.out, comparisons)
        console.print(f"figure: {options.out}", soft_wrap=True)


def _compare_arms(options: Compare, arms: tuple[str, ...], console: Console) -> None:
    from lgmd_gym.benchmark.analysis.arms import arm_table, compare_arms

    others = {"a second run": options.run_b, "--agents": options.agents, "--out": options.out}
    if given := [name for name, value in others.items() if value is not None]:
        raise ValueError(f"--arms compares agents of one run; remove {', '.join(given)}")
    results = compare_arms(options.run_a, arms)
    for condition in dict.fromkeys(result.condition for result in results):
        of_condition = [result for result in results if result.condition == condition]
        console.print(arm_table(of_condition, f"{options.run_a.name}, {condition}"))
