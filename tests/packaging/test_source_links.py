"""A clone works without symbolic links, which git writes as text files on Windows."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lgmd_gym.source_links import LINKS, linked_folders

ROOT = Path(__file__).resolve().parents[2]
NAMES = "import lgmd_gym.envs as e, lgmd_gym.agents.registry as a; print(e.__file__, a.__file__, sep='\\n')"


def make(folder, *names):
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").touch()


def test_folders_in_the_package_need_nothing(tmp_path):
    make(tmp_path / "lgmd_gym", *LINKS)
    assert linked_folders(tmp_path / "lgmd_gym") == []
    assert linked_folders(ROOT / "lgmd_gym") == []


@pytest.mark.parametrize(("text_files", "links"), [(LINKS, ()), (("agents",), ("envs",)), ((), ())])
def test_folders_beside_the_package_are_found(text_files, links, tmp_path):
    make(tmp_path, "lgmd_gym", *LINKS)
    make(tmp_path / "lgmd_gym", *links)
    for name in text_files:
        (tmp_path / "lgmd_gym" / name).write_text(f"../{name}")
    assert linked_folders(tmp_path / "lgmd_gym") == [str(tmp_path)]


@pytest.mark.parametrize("beside", [(), ("envs",)])
def test_missing_folders_are_one_line_with_the_remedy(beside, tmp_path):
    make(tmp_path, "lgmd_gym", *beside)
    with pytest.raises(ImportError) as error:
        linked_folders(tmp_path / "lgmd_gym")
    message = str(error.value)
    assert message.startswith(f"{tmp_path / 'lgmd_gym'} lacks the symbolic links envs and agents; ")
    assert message.endswith(
        "git config core.symlinks true && rm -f lgmd_gym/envs lgmd_gym/agents"
        " && git checkout -- lgmd_gym/envs lgmd_gym/agents"
    )
    assert "\n" not in message


def test_a_clone_without_links_imports(tmp_path):
    """The remedy of the message turns it into a clone with links."""
    clone = tmp_path / "clone"
    git = ["git", "-c", "core.symlinks=false", "clone", "-q", "--depth=1", ROOT.as_uri(), str(clone)]
    subprocess.run(git, check=True)
    # Changes that are not committed yet are tested, too.
    without = shutil.ignore_patterns(*LINKS, "__pycache__")
    shutil.copytree(ROOT / "lgmd_gym", clone / "lgmd_gym", ignore=without, dirs_exist_ok=True)
    assert (clone / "lgmd_gym" / "envs").read_text() == "../envs"

    env = {**os.environ, "PYTHONPATH": str(clone)}
    run = subprocess.run([sys.executable, "-c", NAMES], capture_output=True, text=True, cwd=tmp_path, env=env)
    assert run.stdout.splitlines() == [str(clone / "envs/__init__.py"), str(clone / "agents/registry.py")], (
        run.stderr
    )
    with pytest.raises(ImportError) as error:
        linked_folders(clone / "docs" / "howto")
    subprocess.run(["bash", "-c", str(error.value).partition("run: ")[2]], cwd=clone, check=True)
    assert [os.readlink(clone / "lgmd_gym" / name) for name in LINKS] == ["../envs", "../agents"]
