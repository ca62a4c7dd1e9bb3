"""Packaging: contents of the wheel, import direction and import time."""

import ast
import os
import re
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
HOMES = {"lgmd_gym": ROOT / "lgmd_gym", "lgmd_gym.envs": ROOT / "envs", "lgmd_gym.agents": ROOT / "agents"}

# The folders of the package, highest first. A folder imports only from folders further down.
ORDER = (
    "cli",
    "comparison",
    "report",
    "training",
    "tuning",
    "paper",
    "rendering",
    "clips",
    "openscenario",
    "benchmark",
    "plotting",
    "agents",
    "engine",
    "envs",
    "wrappers",
    "sensing",
    "camera",
    "neuron",
    "statistics",
    "processes",
    "kernels",
    "fields",
    "errors",
    "aliases",
)
# Within these folders, the sub-folders in the same order; "" is the folder's own files.
ORDER_WITHIN = {
    "benchmark": ("analysis", ""),
    "envs": ("traffic", "", "families", "dynamics"),  # `highway` is on the floor of the folder's own files
    "training": ("", "offline"),
}


def folder_of(module):
    return module.split(".")[1] if "." in module else ""


def modules():
    for home in ("lgmd_gym", "lgmd_gym.envs", "lgmd_gym.agents"):
        for path in sorted(HOMES[home].rglob("*.py")):
            inside = path.relative_to(HOMES[home])
            if home == "lgmd_gym" and inside.parts[0] in ("envs", "agents"):
                continue  # the links
            parts = [home, *inside.with_suffix("").parts]
            yield ".".join(part for part in parts if part != "__init__"), path


def imports_of(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} has a relative import"
            if node.module == "lgmd_gym":
                yield from (f"lgmd_gym.{alias.name}" for alias in node.names)
            else:
                yield node.module


def test_every_folder_has_a_place_in_the_order():
    found = {folder_of(module) for module, _ in modules()} - {"", "__main__", "_version"}
    assert found == set(ORDER)


def test_folders_import_one_way():
    """`lgmd_gym` itself, `__main__` and the version stand outside the order."""
    wrong = []
    for module, path in modules():
        folder = folder_of(module)
        if folder not in ORDER:
            continue
        for name in imports_of(path):
            target = folder_of(name)
            if name.startswith("lgmd_gym.") and target in ORDER and ORDER.index(target) < ORDER.index(folder):
                wrong.append(f"{module} imports {name}")
    assert wrong == []


def subfolder_of(module):
    folder, _, rest = module.removeprefix("lgmd_gym.").partition(".")
    name = rest.split(".")[0]
    return name if name in ORDER_WITHIN.get(folder, ()) else ""


def test_subfolders_import_one_way():
    wrong = []
    for module, path in modules():
        order = ORDER_WITHIN.get(folder_of(module))
        if order is None:
            continue
        for name in imports_of(path):
            same = name.startswith("lgmd_gym.") and folder_of(name) == folder_of(module)
            if same and order.index(subfolder_of(name)) < order.index(subfolder_of(module)):
                wrong.append(f"{module} imports {name}")
    assert wrong == []


@pytest.fixture(scope="module")
def bare():
    """Modules that `lgmd_gym` itself loads; it loads Gymnasium to register the ids."""
    return set(run("import sys, lgmd_gym; print(*sys.modules)").split())


@pytest.mark.parametrize(("folder", "unrelated"), [
    ("neuron", ("gymnasium", "highway_env", "lgmd_gym.camera")),
    ("camera", ("gymnasium", "pandas", "lgmd_gym.neuron")),
    ("agents", ("gymnasium", "highway_env", "lgmd_gym.envs", "lgmd_gym.neuron")),
])  # fmt: skip
def test_low_level_folders_load_no_unrelated_package(folder, unrelated, bare):
    loaded = run(f"import sys, lgmd_gym.{folder}; print(*sys.modules)").split()
    assert [name for name in unrelated if name in loaded and name not in bare] == []


def run(code, **kwargs):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, **kwargs
    ).stdout


@pytest.mark.bench
def test_import_is_fast():
    """The import adds under 0.2 s to the start of the interpreter (fastest of five runs)."""

    def timed(code):
        start = time.perf_counter()
        run(code)
        return time.perf_counter() - start

    assert min(timed("import lgmd_gym") for _ in range(5)) - min(timed("pass") for _ in range(5)) < 0.2


def test_the_package_folder_contains_four_modules_and_folders():
    flat = {path.name for path in (ROOT / "lgmd_gym").glob("*.py")}
    assert flat == {"__init__.py", "__main__.py", "_version.py", "aliases.py", "errors.py", "fields.py"}


def test_every_package_states_its_contents_in_one_sentence():
    for module, path in modules():
        if path.name == "__init__.py":
            docstring = ast.get_docstring(ast.parse(path.read_text()))
            assert docstring, f"{module} has no docstring"
            assert docstring.splitlines()[0].endswith("."), f"{module}: {docstring.splitlines()[0]!r}"


def test_the_package_list_matches_the_folders():
    mapping = PROJECT["tool"]["setuptools"]["package-dir"]
    listed = PROJECT["tool"]["setuptools"]["packages"]
    found = {module for module, path in modules() if path.name == "__init__.py"}
    assert set(listed) == found
    assert mapping == {"lgmd_gym": "lgmd_gym", "lgmd_gym.envs": "envs", "lgmd_gym.agents": "agents"}
    tree = subprocess.run(["git", "ls-tree", "HEAD", "lgmd_gym/"], cwd=ROOT, capture_output=True, text=True)
    links = re.findall(r"^120000 blob \w+\tlgmd_gym/(\w+)$", tree.stdout, re.MULTILINE)
    assert links == ["agents", "envs"]


@pytest.mark.slow
def test_a_wheel_built_from_the_sdist_is_complete_and_has_one_top_level_package(tmp_path):
    """Build the sdist, build a wheel from it, and import the wheel from another folder."""
    subprocess.run(["git", "clone", "-q", str(ROOT), str(tmp_path / "clone")], check=True)
    links = [".github/absolute_links.py", "https://example.org/owner/name", "v1"]  # as publish.yml does
    subprocess.run([sys.executable, *links], cwd=tmp_path / "clone", check=True)
    build = "import setuptools.build_meta as b; print(b.build_sdist(r'{out}'))"
    source = run(build.format(out=tmp_path), cwd=tmp_path / "clone").splitlines()[-1]
    subprocess.run(["tar", "-xzf", str(tmp_path / source), "-C", str(tmp_path)], check=True)
    folder = tmp_path / source.removesuffix(".tar.gz")
    wheel = run(build.replace("sdist", "wheel").format(out=tmp_path), cwd=folder).splitlines()[-1]
    check_descriptions(tmp_path / source, tmp_path / wheel)
    names = zipfile.ZipFile(tmp_path / wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"lgmd_gym"}
    for source_file in (tmp_path / "clone").glob("*/**/*.py"):
        inside = source_file.relative_to(tmp_path / "clone")
        if inside.parts[0] in ("envs", "agents"):
            inside = Path("lgmd_gym") / inside
        if inside.parts[0] == "lgmd_gym":
            assert inside.as_posix() in names
    assert "lgmd_gym/py.typed" in names
    assert {f"lgmd_gym/neuron/export_c/{name}" for name in ("lgmd.c", "lgmd.h", "main.c")} < set(names)
    assert "lgmd_gym/agents/policies/all-round.zip" in names
    zipfile.ZipFile(tmp_path / wheel).extractall(tmp_path / "site")
    code = "import gymnasium, lgmd_gym.envs as e; print(e.__file__); "
    code += "gymnasium.make('LGMD/CCRs-v0')"
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    assert run(code, cwd=tmp_path, env=env).startswith(str(tmp_path / "site"))
    env["PYTHONPATH"] = str(folder)  # an unpacked sdist, which lacks the links to envs and agents
    code = "import lgmd_gym.envs as e; print(e.__file__)"
    assert run(code, cwd=tmp_path, env=env).startswith(str(folder / "envs"))


def check_descriptions(source, wheel):
    """Check that a package index renders the descriptions, and that their links are absolute."""
    check = [sys.executable, "-m", "twine", "check", "--strict", str(source), str(wheel)]
    done = subprocess.run(check, capture_output=True, text=True)
    assert (done.returncode, done.stdout.count("PASSED")) == (0, 2), done.stdout
    archive = zipfile.ZipFile(wheel)
    (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
    metadata = archive.read(name).decode()
    assert "\nProject-URL: Repository, https://example.org/owner/name\n" in metadata
    targets = re.findall(r"\]\(([^)]+)\)", metadata)
    assert targets
    assert [target for target in targets if not target.startswith("https://")] == []


def test_ci_runs_the_test_command_of_the_readme():
    commands = [
        line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("python3 -m venv")
    ]
    assert len(commands) == 2
    assert commands[0].endswith("lgmd-gym bench")
    assert commands[1] in (ROOT / ".ci" / "run").read_text()
