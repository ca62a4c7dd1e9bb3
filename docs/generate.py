"""Make the pages, figures and films of the documentation that come from code.

    python docs/generate.py

Films are kept from one build to the next; delete docs/_generated to have them made anew.
"""

import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import figures

from lgmd_gym.benchmark.analysis.tables import mean_kmh
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.executor import Executor
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.statistics import Rate
from lgmd_gym.benchmark.summary import summaries
from lgmd_gym.cli import main as cli
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.random_braking import RandomBrakingEnv
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.envs.traffic.registration import traffic_id
from lgmd_gym.gallery.docstrings import About
from lgmd_gym.gallery.scenes import Scene, film, find_scenes

AGENT = "spike-threshold"


def main(out: Path) -> None:
    """Make everything in a folder."""
    static, pages = out / "static", out / "environments"
    for folder in (static, pages):
        folder.mkdir(parents=True, exist_ok=True)
    for scene in find_scenes():
        if not (static / f"{scene.name}.mp4").exists():
            _film(scene, static)
        (pages / f"{scene.name}.md").write_text(environment_page(scene), encoding="utf-8")
    for cls in (BrakingEnv, RandomBrakingEnv, TrafficEnv):
        (pages / f"{cls.__name__}.md").write_text(class_page(cls), encoding="utf-8")
    (out / "commands.md").write_text(commands_page(), encoding="utf-8")
    (out / "benchmark.md").write_text(benchmark_table(), encoding="utf-8")
    figures.main(static)


def _film(scene: Scene, static: Path) -> None:
    """Make a film under another name first, so that a build broken off leaves no half film."""
    film(scene, AGENT, static / f"making-{scene.name}")
    for suffix in (".jpg", ".mp4"):
        shutil.move(static / f"making-{scene.name}{suffix}", static / f"{scene.name}{suffix}")


def environment_page(scene: Scene) -> str:
    """Return the page of one scenario family or kind of traffic, from its docstring."""
    base = "BrakingEnv" if scene.judged else "TrafficEnv"
    film_tag = (
        f'<video src="../../_static/{scene.name}.mp4" poster="../../_static/{scene.name}.jpg" '
        'controls muted loop preload="none" width="100%"></video>'
    )
    if scene.judged:
        example = f'gym.make("lgmd_gym:{scene.target}")'
    else:
        example = f'gym.make("lgmd_gym:{traffic_id(scene.name)}")'
    parts = [
        f"# {scene.target}",
        scene.about.lead,
        f"```{{raw}} html\n{film_tag}\n```",
        f"`{example}`, or `lgmd-gym drive {scene.target} --live`. In the film `{AGENT}` brakes.",
        _prose(scene.about.text),
        arguments_table(scene.about),
        f"Actions, observations, rewards, ends and info are those of [{base}]({base}.md).",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def arguments_table(about: About) -> str:
    """Return a docstring's arguments as a Markdown table; empty without any."""
    if not about.arguments:
        return ""
    rows = [f"| `{name}` | `{default or '–'}` | {text} |" for name, default, text in about.arguments]
    return "\n".join(["| argument | default | |", "|---|---|---|", *rows])


def class_page(cls: Any) -> str:
    """Return the page of an environment class: its docstring, whose sections are Markdown already."""
    doc = inspect.getdoc(cls) or ""
    return f"# {cls.__name__}\n\n" + _lists(doc) + "\n"


def _lists(doc: str) -> str:
    """Turn the Args and Raises of a docstring into Markdown lists; the rest stays."""
    out: list[str] = []
    inside = False
    for line in doc.splitlines():
        if re.match(r"^(Args|Raises|Attributes):$", line):
            inside = True
            out += ["", "" if line == "Args:" else f"**{line}**", ""]
        elif inside and (item := re.match(r"^    (\w+): (.*)", line)):
            out.append(f"- `{item[1]}`: {item[2]}")
        elif inside and line.startswith("     "):
            out.append(f"  {line.strip()}")
        else:
            inside = inside and not line.strip()
            out.append(line)
    return "\n".join(out)


def _prose(text: str) -> str:
    """Return the text of a docstring without its headings, which the page has its own of."""
    return "\n\n".join(part for part in text.split("\n\n") if not part.startswith("#"))


def benchmark_table() -> str:
    """Play the quick suite and return its scores as a Markdown table."""
    with TemporaryDirectory() as folder:
        run = Run.new(RunConfig(), Path(folder) / "run", Executor(jobs=2))
        run.play()
    rows = [
        "| agent | avoided | impact speed taken off | premature | false braking |",
        "|---|---|---|---|---|",
    ]
    for item in summaries(run.rows, lambda row: ""):
        taken = f"{mean_kmh(item.speed_reduction)} km/h"
        rates = [_rate(rate) for rate in (item.avoided, item.premature, item.false_activations)]
        rows.append(f"| `{item.agent}` | {rates[0]} | {taken} | {rates[1]} | {rates[2]} |")
    return "\n".join(rows) + "\n"


def _rate(rate: Rate) -> str:
    return f"{rate.k}/{rate.n} ({100 * rate.low:.0f}–{100 * rate.high:.0f} %)"


def commands_page() -> str:
    """Return the help of every command as it is printed."""
    names = [get_args(item)[1].name for item in get_args(cli.Command)]
    parts = ["# Commands", "Every command has its own `--help`; this is what they print."]
    for name in names:
        said = subprocess.run(
            [sys.executable, "-m", "lgmd_gym", name, "--help"], capture_output=True, text=True, check=True
        ).stdout
        parts.append(f"## lgmd-gym {name}\n\n```text\n{said.rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main(Path(__file__).parent / "_generated")
