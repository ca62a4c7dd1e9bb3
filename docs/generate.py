"""Generate the documentation's pages, figures and videos from the code.

    python docs/generate.py

Existing videos are reused; delete docs/_generated to record them again.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import architecture
import figures
from docstring_markdown import as_markdown
from environment_pages import VIDEO_AGENT, all_cards, environment_page, id_of, overview_tables
from joblib import Parallel, delayed
from reference_returns import read_returns

from lgmd_gym.benchmark.analysis.tables import mean_kmh
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.summary import INTERVAL_TEXT, Sample, summaries
from lgmd_gym.cli.main import COMMANDS
from lgmd_gym.clips import study
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.paper.claims import claims_text, evaluate_claims
from lgmd_gym.paper.experiments import run_experiments
from lgmd_gym.paper.plots import clip_figures, paper_figures
from lgmd_gym.processes.pool import Executor
from lgmd_gym.report.gallery.cards import ScenarioCard, record_video
from lgmd_gym.statistics.intervals import Rate


def main(out: Path) -> None:
    """Write all pages, figures and videos to a folder."""
    static, pages = out / "static", out / "environments"
    for folder in (static, pages):
        folder.mkdir(parents=True, exist_ok=True)
    returns = read_returns(Path(__file__).parent / "returns.csv")
    cards = all_cards()
    missing = [card for card in cards if not (static / f"{card.name}.mp4").exists()]
    Parallel(n_jobs=2)(delayed(_record)(card, static) for card in missing)
    for card in cards:
        page = environment_page(card, returns.get(id_of(card), ()))
        (pages / f"{card.name}.md").write_text(page, encoding="utf-8")
    for cls in (BrakingEnv, TrafficEnv):
        page = f"# {cls.__name__}\n\n{as_markdown(cls)}\n"
        (pages / f"{cls.__name__}.md").write_text(page, encoding="utf-8")
    (out / "environments.md").write_text(overview_tables(returns), encoding="utf-8")
    (out / "commands.md").write_text(commands_page(), encoding="utf-8")
    (out / "benchmark.md").write_text(benchmark_table(), encoding="utf-8")
    paper_results(out, static / "paper")
    figures.main(static)
    architecture.main(static / "architecture.svg")


def _record(card: ScenarioCard, static: Path) -> None:
    """Record a video under a temporary name, so that an interrupted build leaves no incomplete video."""
    record_video(card, VIDEO_AGENT, static / f"incomplete-{card.name}")
    for suffix in (".jpg", ".mp4"):
        shutil.move(static / f"incomplete-{card.name}{suffix}", static / f"{card.name}{suffix}")


def benchmark_table() -> str:
    """Run the default benchmark and return its summary as a Markdown table."""
    with TemporaryDirectory() as folder:
        run = Run.new(RunConfig(), Path(folder) / "run", Executor(jobs=2))
        run.play()
    rows = [
        "| agent | avoided | speed reduction | premature | false activations |",
        "|---|---|---|---|---|",
    ]
    for item in summaries(run.rows, lambda row: ""):
        reduction = f"{mean_kmh(item.speed_reduction)} km/h"
        rates = [_rate(rate) for rate in (item.avoided, item.premature, item.false_activations)]
        rows.append(f"| `{item.agent}` | {rates[0]} | {reduction} | {rates[1]} | {rates[2]} |")
    return "\n".join(rows) + f"\n\n{Sample.of(run.rows)}; {INTERVAL_TEXT}.\n"


def _rate(rate: Rate) -> str:
    return f"{rate.k}/{rate.n} ({100 * rate.low:.0f}–{100 * rate.high:.0f} %)"


def paper_results(out: Path, folder: Path) -> None:
    """Repeat the experiments of the paper; write its claims, the tables of clips and the figures."""
    folder.mkdir(exist_ok=True)
    results = run_experiments(lambda: None)
    traces = study.read_traces(Path(__file__).parent / "clip_traces.csv")
    crashes = study.published_crashes([trace.clip for trace in traces])
    claims = evaluate_claims(results, study.detections_of(traces, crashes)[study.HEADLINE])
    (out / "claims.md").write_text(claims_text(claims), encoding="utf-8")
    (out / "clips.md").write_text(study.results_text(traces, crashes), encoding="utf-8")
    paper_figures(results, folder)
    clip_figures(traces, crashes, folder)


def commands_page() -> str:
    """Return the help text of every command."""
    parts = ["# Commands", "The output of `lgmd-gym COMMAND --help` for every command."]
    for name in [name for command in COMMANDS for name in subcommands(command)]:
        command = [sys.executable, "-m", "lgmd_gym", *name.split(), "--help"]
        text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        parts.append(f"## lgmd-gym {name}\n\n```text\n{text.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def subcommands(command: str) -> list[str]:
    """Return a command with each of its subcommands, or alone."""
    known = getattr(COMMANDS[command], "SUBCOMMANDS", {})
    return [f"{command} {name}" for name in known] or [command]


if __name__ == "__main__":
    main(Path(__file__).parent / "_generated")
