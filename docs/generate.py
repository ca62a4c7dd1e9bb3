"""Generate the documentation's pages, figures and videos from the code.

    python docs/generate.py

Existing videos are reused; delete docs/_generated to record them again.
"""

import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import figures

from lgmd_gym.benchmark.analysis.tables import mean_kmh
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.executor import Executor
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.statistics import Rate
from lgmd_gym.benchmark.summary import INTERVAL_TEXT, Sample, summaries
from lgmd_gym.cli.main import COMMANDS
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.envs.traffic.registration import traffic_id
from lgmd_gym.gallery.cards import ScenarioCard, record_video, scenario_cards
from lgmd_gym.gallery.docstrings import ParsedDocstring

AGENT = "spike-threshold"


def main(out: Path) -> None:
    """Write all pages, figures and videos to a folder."""
    static, pages = out / "static", out / "environments"
    for folder in (static, pages):
        folder.mkdir(parents=True, exist_ok=True)
    for card in scenario_cards():
        if not (static / f"{card.name}.mp4").exists():
            _record(card, static)
        (pages / f"{card.name}.md").write_text(environment_page(card), encoding="utf-8")
    for cls in (BrakingEnv, RandomLevels, TrafficEnv):
        (pages / f"{cls.__name__}.md").write_text(class_page(cls), encoding="utf-8")
    (out / "commands.md").write_text(commands_page(), encoding="utf-8")
    (out / "benchmark.md").write_text(benchmark_table(), encoding="utf-8")
    figures.main(static)


def _record(card: ScenarioCard, static: Path) -> None:
    """Record a video under a temporary name, so that an interrupted build leaves no incomplete video."""
    record_video(card, AGENT, static / f"incomplete-{card.name}")
    for suffix in (".jpg", ".mp4"):
        shutil.move(static / f"incomplete-{card.name}{suffix}", static / f"{card.name}{suffix}")


def environment_page(card: ScenarioCard) -> str:
    """Return the page of one scenario family or kind of traffic."""
    base = "TrafficEnv" if card.traffic else "BrakingEnv"
    video_tag = (
        f'<video src="../../_static/{card.name}.mp4" poster="../../_static/{card.name}.jpg" '
        'controls muted loop preload="none" width="100%"></video>'
    )
    env_id = traffic_id(card.name) if card.traffic else card.target
    parts = [
        f"# {card.target}",
        card.docstring.summary,
        f"```{{raw}} html\n{video_tag}\n```",
        f'`gym.make("lgmd_gym:{env_id}")`, or `lgmd-gym drive {card.target} --live`. '
        f"The agent in the video is `{AGENT}`.",
        _without_headings(card.docstring.text),
        arguments_table(card.docstring),
        f"Actions, observations, rewards, termination and info are those of [{base}]({base}.md).",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def arguments_table(docstring: ParsedDocstring) -> str:
    """Return the arguments in a docstring as a Markdown table; empty without arguments."""
    if not docstring.arguments:
        return ""
    rows = [f"| `{name}` | `{default or '–'}` | {text} |" for name, default, text in docstring.arguments]
    return "\n".join(["| argument | default | |", "|---|---|---|", *rows])


def class_page(cls: Any) -> str:
    """Return the page of an environment class, from its docstring in Markdown."""
    doc = inspect.getdoc(cls) or ""
    return f"# {cls.__name__}\n\n" + _lists(doc) + "\n"


def _lists(doc: str) -> str:
    """Return a docstring with its Args, Raises and Attributes as Markdown lists."""
    lines: list[str] = []
    in_section = False
    for line in doc.splitlines():
        if re.match(r"^(Args|Raises|Attributes):$", line):
            in_section = True
            lines += ["", "" if line == "Args:" else f"**{line}**", ""]
        elif in_section and (item := re.match(r"^    (\w+): (.*)", line)):
            lines.append(f"- `{item[1]}`: {item[2]}")
        elif in_section and line.startswith("     "):
            lines.append(f"  {line.strip()}")
        else:
            in_section = in_section and not line.strip()
            lines.append(line)
    return "\n".join(lines)


def _without_headings(text: str) -> str:
    """Return the text of a docstring without its headings."""
    return "\n\n".join(part for part in text.split("\n\n") if not part.startswith("#"))


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


def commands_page() -> str:
    """Return the help text of every command."""
    parts = ["# Commands", "The output of `lgmd-gym COMMAND --help` for every command."]
    for name in COMMANDS:
        text = subprocess.run(
            [sys.executable, "-m", "lgmd_gym", name, "--help"], capture_output=True, text=True, check=True
        ).stdout
        parts.append(f"## lgmd-gym {name}\n\n```text\n{text.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main(Path(__file__).parent / "_generated")
