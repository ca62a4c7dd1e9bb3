"""Every code block of README and the documentation runs; every page is reached; nothing is left out."""

import re
import shlex
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from joblib.externals.loky import get_reusable_executor

from lgmd_gym.agents import AGENTS
from lgmd_gym.benchmark.rows import KEYS
from lgmd_gym.cli import main as cli
from lgmd_gym.training.config import Order
from lgmd_gym.video import VideoWriter

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    path for path in DOCS.rglob("*.md") if not {"_generated", "_build"} & set(path.relative_to(DOCS).parts)
)
# Installing and testing are run by .ci/run, and by whoever reads this; the rest of a shell block runs here.
ELSEWHERE = (
    "python3 -m venv",
    "source .venv",
    "pip install",
    ".venv/bin/",
    "git clone",
    "python docs/examples/",
)
# Pages whose blocks take under a second; the others run with -m slow.
QUICK = {"README", "neuron", "own_scenario"}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def pages():
    found = []
    for path in [ROOT / "README.md", *PAGES]:
        kinds = [kind for kind, _ in BLOCK.findall(path.read_text())]
        if {"python", "bash"} & set(kinds):
            slow = path.stem not in QUICK
            found.append(pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if slow else []))
    return found


@pytest.mark.parametrize("path", pages())
def test_code_blocks_run(path, tmp_path, monkeypatch):
    """In the order of the page, in one folder, Python blocks in one namespace."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    make_clip(tmp_path / "clip.mp4")
    get_reusable_executor().shutdown(wait=True)  # another page's workers look in another folder
    space = {"__name__": path.stem}
    for kind, block in BLOCK.findall(path.read_text()):
        assert kind in ("python", "bash", "text", "yaml"), f"say here what is done with a block of {kind}"
        if kind == "python":
            exec(compile(block, path.name, "exec"), space)
            keep_module(path, block, tmp_path)
        elif kind == "bash":
            for line in block.strip().splitlines():
                run_line(line)
        elif kind == "yaml":  # hyperparameters
            (tmp_path / "hyper.yml").write_text(block)
            Order("recorded", hyperparams=tmp_path / "hyper.yml", inputs=("frame",)).plan()
    sys.modules.pop("my_agent", None)


def make_clip(path):
    rng = np.random.default_rng(0)
    with VideoWriter(path, fps=25.0) as writer:
        for size in range(2, 26):
            picture = rng.integers(90, 110, (64, 96, 3), np.uint8)
            picture[32 - size : 32 + size, 48 - size : 48 + size] = 20
            writer.write(picture)


def keep_module(path, block, folder):
    """A page that says "Write `name.py`:" before a block means the file."""
    before = path.read_text().split(block)[0]
    named = re.search(r"Write `(\w+\.py)`:\s*```python\n$", before)
    if named:
        (folder / named[1]).write_text(block)


def run_line(line):
    line = line.split("#")[0].strip()
    if not line or line.startswith(ELSEWHERE):
        return
    assert line.startswith("lgmd-gym "), f"say in ELSEWHERE who runs: {line}"
    assert cli.run(shlex.split(line)[1:]) == 0, line


def test_every_page_is_in_a_toctree():
    named = set()
    for path in PAGES:
        for block in re.findall(r"^```\{toctree\}\n(.*?)^```", path.read_text(), re.DOTALL | re.MULTILINE):
            named |= {(path.parent / line).resolve() for line in block.split() if not line.startswith(":")}
    reached = {path.with_suffix("") for path in PAGES} - {DOCS / "index"}
    assert reached <= named, f"not reached: {sorted(map(str, reached - named))}"


def test_links_between_pages_lead_somewhere():
    for path in PAGES:
        for target in re.findall(r"\]\(([^)#]+)\)", path.read_text()):
            if not target.startswith("http") and "_generated" not in target:
                assert (path.parent / target).exists(), f"{path.name} links to {target}"


def test_reference_leaves_nothing_out():
    metrics = (DOCS / "reference" / "metrics.md").read_text()
    assert [key for key in KEYS if f"`{key}`" not in metrics] == []
    agents = (DOCS / "reference" / "agents.md").read_text()
    assert [cls.__name__ for cls in AGENTS.values() if f"agents.{cls.__name__}\n" not in agents] == []


def test_citation_file_names_the_package():
    text = (ROOT / "CITATION.cff").read_text()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert re.search(r"^cff-version: 1\.2\.0$", text, re.MULTILINE)
    assert f"title: {project['name']}" in text
    assert f"license: {project['license']}" in text


def test_pictures_of_the_repository_are_small():
    """All pictures that a clone brings, together under 3 MB."""
    kinds = {".png", ".gif", ".jpg", ".mp4", ".svg"}
    ours = [path for path in DOCS.rglob("*") if path.suffix in kinds]
    kept = [path for path in ours if not {"_generated", "_build"} & set(path.relative_to(DOCS).parts)]
    assert kept
    assert sum(path.stat().st_size for path in kept) < 3_000_000
