"""The `compare` command."""

from rich.console import Console

from lgmd_gym.benchmark.analysis.compare import compare_runs
from lgmd_gym.benchmark.analysis.compare_tables import arm_table, comparison_table
from lgmd_gym.benchmark.analysis.plots import difference_figure
from lgmd_gym.benchmark.analysis.trainings import compare_arms
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Compare
from lgmd_gym.processes.files import check_new_file


def run(options: Compare) -> int:
    """Print the paired differences of agents, or the results of arms."""
    if options.arms is None:
        _compare_pairs(options, make_console())
    else:
        _compare_arms(options, options.arms, make_console())
    return 0


def _compare_pairs(options: Compare, console: Console) -> None:
    if options.out is not None:
        check_new_file(options.out, "--out")
    comparisons = compare_runs(options.run_a, options.run_b, options.agents)
    for comparison in comparisons:
        console.print(comparison_table(comparison))
    if options.out is not None:
        difference_figure(options.out, comparisons)
        console.print(f"figure: {options.out}", soft_wrap=True)


def _compare_arms(options: Compare, arms: tuple[str, ...], console: Console) -> None:
    others = {"a second run": options.run_b, "--agents": options.agents, "--out": options.out}
    if given := [name for name, value in others.items() if value is not None]:
        raise ValueError(f"--arms compares agents of one run; remove {', '.join(given)}")
    results = compare_arms(options.run_a, arms)
    for condition in dict.fromkeys(result.condition for result in results):
        of_condition = [result for result in results if result.condition == condition]
        console.print(arm_table(of_condition, f"{options.run_a.name}, {condition}"))
