"""The documentation: its code blocks run, its links resolve, and the reference is complete."""

import pkgutil
import re
import shlex
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from joblib.externals.loky import get_reusable_executor
from support.own_families import forget_families

from lgmd_gym import __version__
from lgmd_gym.agents import AGENTS
from lgmd_gym.benchmark.metrics import KEYS
from lgmd_gym.benchmark.suites import SUITES, load_suite
from lgmd_gym.cli import main as cli
from lgmd_gym.clips import VideoWriter
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.registration import TRAFFIC_KINDS
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.trainer import check_config

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    path for path in DOCS.rglob("*.md") if not {"_generated", "_build"} & set(path.relative_to(DOCS).parts)
)
# Lines of shell blocks that do not run here; .ci/run installs the package and runs the tests.
ELSEWHERE = (
    "python3 -m venv",
    "source .venv",
    "pip install",
    ".venv/bin/",
    "git clone",
    "python docs/examples/",
    "python docs/experiments/",
)
# Pages whose blocks take under a second; the others run with -m slow.
QUICK = {"README", "neuron"}
GROUPS = ("Added", "Changed", "Deprecated", "Removed", "Fixed", "Security")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def pages():
    found = []
    for path in [ROOT / "README.md", *PAGES]:
        kinds = [kind for kind, _ in BLOCK.findall(path.read_text())]
        if {"python", "bash"} & set(kinds):
            slow = path.stem not in QUICK
            found.append(pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if slow else []))
    return found


@pytest.mark.usefixtures("moviepy")
@pytest.mark.parametrize("path", pages())
def test_code_blocks_run(path, tmp_path, monkeypatch):
    """Run the blocks of a page in order, in one folder; Python blocks share a namespace.

    The suites "quick" and "overview" are shortened.
    """
    monkeypatch.chdir(tmp_path)
    for name in ("quick", "overview"):
        short = tuple(case for case in SUITES[name].cases if case.family in ("CCRs", "EmptyRoad"))
        monkeypatch.setitem(SUITES, name, replace(SUITES[name], cases=short))
    monkeypatch.syspath_prepend(str(tmp_path))
    make_clip(tmp_path / "clip.mp4")
    get_reusable_executor().shutdown(wait=True)  # workers of another page have another working folder
    space = {"__name__": path.stem}
    for kind, block in BLOCK.findall(path.read_text()):
        assert kind in ("python", "bash", "text", "toml", "yaml"), (
            f"{path.name}: unexpected code block of kind {kind!r}"
        )
        if write_file(path, block, tmp_path):
            continue
        if kind == "python":
            exec(compile(block, path.name, "exec"), space)
        elif kind == "bash":
            for line in block.strip().splitlines():
                run_line(line)
        elif kind == "toml":  # a suite
            (tmp_path / "suite.toml").write_text(block)
            assert load_suite(tmp_path / "suite.toml").cases
        elif kind == "yaml":  # hyperparameters
            (tmp_path / "hyper.yml").write_text(block)
            file = tmp_path / "hyper.yml"
            check_config(TrainConfig.from_hyperparams("time-to-brake", file=file))
    sys.modules.pop("my_agent", None)
    forget_families()


def make_clip(path):
    rng = np.random.default_rng(0)
    with VideoWriter(path, fps=25.0) as writer:
        for size in range(2, 26):
            picture = rng.integers(90, 110, (64, 96, 3), np.uint8)
            picture[32 - size : 32 + size, 48 - size : 48 + size] = 20
            writer.write(picture)


def write_file(path, block, folder):
    """Write a block to a file if the page introduces it with "Write `name.py`:"; return whether it does."""
    before = path.read_text().split(block)[0]
    named = re.search(r"Write\s`(\w+\.(py|toml))`:\s*```\w+\n$", before)
    if named:
        (folder / named[1]).write_text(block)
    return bool(named)


def run_line(line):
    line = line.split("#")[0].strip()
    if not line or line.startswith(ELSEWHERE):
        return
    assert line.startswith("lgmd-gym "), f"not an lgmd-gym command and not in ELSEWHERE: {line}"
    command = shlex.split(line)[1:]
    if command[0] == "bench" and {"--jobs", "--resume"}.isdisjoint(command):
        command += ["--jobs", "1"]  # starting two processes takes longer than a short run
    assert cli.run(command) == 0, line


def test_every_page_is_in_a_toctree():
    named = set()
    for path in PAGES:
        for block in re.findall(r"^```\{toctree\}\n(.*?)^```", path.read_text(), re.DOTALL | re.MULTILINE):
            named |= {(path.parent / line).resolve() for line in block.split() if not line.startswith(":")}
    reached = {path.with_suffix("") for path in PAGES} - {DOCS / "index"}
    assert reached <= named, f"in no toctree: {sorted(map(str, reached - named))}"


def test_links_on_the_forge_resolve():
    """Targets of relative links exist in the repository, and so do their headings."""
    dead = []
    others = [ROOT / ".github" / "pull_request_template.md", ROOT / "tests" / "reference" / "README.md"]
    for path in [*ROOT.glob("*.md"), *others, *PAGES]:
        text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            file, _, heading = target.partition("#")
            found = path.parent / file if file else path
            if target.startswith(("http", "mailto:")):
                continue
            if not found.exists() or "_generated" in file or (heading and heading not in headings(found)):
                dead.append(f"{path.relative_to(ROOT)}: {target}")
    assert dead == []


def headings(path):
    """Return the anchors of the headings of a page."""
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_generated_pages_and_pictures_are_made_by_the_build():
    """Plain Markdown does not link them: a reference in braces is no dead link on the forge."""
    names = {env_id(name).removeprefix("LGMD/").removesuffix("-v0") for name in FAMILIES}
    names |= {"BrakingEnv", "TrafficEnv", "RandomBraking", "RandomBrakingEasy", *TRAFFIC_KINDS}
    for path in PAGES:
        for name in re.findall(r"_generated/environments/(\w+)", path.read_text()):
            assert name in names, f"{path.name}: {name}"


def test_every_object_is_described_once():
    """Sphinx warns of a second description, and the build takes warnings as errors."""
    found = [name for path in PAGES for name in re.findall(r"^\.\. auto\w+:: (\S+)", path.read_text(), re.M)]
    assert [name for name in found if found.count(name) > 1] == []


def test_names_of_the_package_on_the_pages_resolve():
    wrong = []
    for path in [ROOT / "README.md", *PAGES]:
        for name in set(re.findall(r"\blgmd_gym(?:\.\w+)+", path.read_text())):
            try:
                pkgutil.resolve_name(name)
            except (ImportError, AttributeError):
                wrong.append(f"{path.name}: {name}")
    assert wrong == []


def test_paths_on_the_page_about_the_architecture_exist():
    paths = re.findall(r"`([\w./]+/[\w./]*)`", (DOCS / "architecture.md").read_text())
    assert len(paths) > 20
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_the_page_on_protocols_counts_the_cases_of_its_suites():
    rows = re.findall(r"^\| `([\w-]+)` \| .* \| (\d+) \|$", (DOCS / "protocols.md").read_text(), re.MULTILINE)
    assert len(rows) == 16
    assert [(name, int(count)) for name, count in rows if len(SUITES[name].cases) != int(count)] == []


def test_every_experiment_is_on_the_list():
    text = (DOCS / "experiments" / "README.md").read_text()
    found = {path.relative_to(DOCS / "experiments").parts[0] for path in (DOCS / "experiments").rglob("*.py")}
    assert [name for name in found if f"`{name.removesuffix('.py')}" not in text] == []


def test_the_reference_lists_every_row_key_and_agent():
    metrics = (DOCS / "reference" / "metrics.md").read_text()
    assert [key for key in KEYS if f"`{key}`" not in metrics] == []
    agents = (DOCS / "reference" / "agents.md").read_text()
    assert [cls.__name__ for cls in AGENTS.values() if f"agents.{cls.__name__}\n" not in agents] == []


def test_the_citation_file_matches_the_project():
    text = (ROOT / "CITATION.cff").read_text()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert re.search(r"^cff-version: 1\.2\.0$", text, re.MULTILINE)
    assert f"title: {project['name']}" in text
    assert f"license: {project['license']}" in text
    assert re.search(rf"^version: {re.escape(__version__)}$", text, re.MULTILINE)


def test_the_version_is_stated_once_and_cited():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "version" not in project["project"]
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "lgmd_gym._version.__version__"}
    assert "\nrelease = __version__\n" in (DOCS / "conf.py").read_text()
    assert f"version = {{{__version__}}}," in (DOCS / "citing.md").read_text()


def test_the_page_cites_the_paper_of_the_citation_file():
    (paper,) = yaml.safe_load((ROOT / "CITATION.cff").read_text())["references"]
    page = (DOCS / "citing.md").read_text()
    authors = [f"{author['family-names']}, {author['given-names']}" for author in paper["authors"]]
    assert f"author    = {{{' and '.join(authors)}}}," in page
    assert f"title     = {{{paper['title']}}}," in page
    assert f"booktitle = {{{paper['collection-title']}}}," in page
    assert f"year      = {{{paper['year']}}}," in page


def test_the_changelog_has_the_groups_of_keep_a_changelog():
    text = (ROOT / "CHANGELOG.md").read_text()
    title, unreleased, *versions = re.split(r"^## ", text, flags=re.MULTILINE)
    assert title.startswith("# Changelog\n")
    assert unreleased.startswith("[Unreleased]\n")
    for version in versions:
        assert re.match(r"\[\d+\.\d+\.\d+\] - \d{4}-\d{2}-\d{2}\n", version)
    for section in (unreleased, *versions):
        groups = re.findall(r"^### (.*)$", section, re.MULTILINE)
        assert groups == [group for group in GROUPS if group in groups]
        entries = re.findall(r"^- (.{60})", section, re.MULTILINE)
        assert [entry for entry in entries if entries.count(entry) > 1] == []


def test_cards_are_short():
    """That on the design of a policy has tables of its own."""
    cards = [path for path in (DOCS / "cards").glob("*.md") if not path.stem.endswith("-design")]
    assert len(cards) > 2
    assert [path.stem for path in cards if len(path.read_text().split()) > 800] == []


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 130


def test_pictures_are_small():
    """All pictures in the repository are under 4.5 MB together."""
    kinds = {".png", ".gif", ".jpg", ".mp4", ".svg", ".webp"}
    ours = [path for path in DOCS.rglob("*") if path.suffix in kinds]
    kept = [path for path in ours if not {"_generated", "_build"} & set(path.relative_to(DOCS).parts)]
    assert kept
    assert sum(path.stat().st_size for path in kept) < 4_500_000
