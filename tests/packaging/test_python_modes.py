"""Other ways to run Python: without assert statements, and with the oldest dependencies."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
# Tests of refused values; pytest evaluates the assert statements of test files also with -O.
REFUSALS = ("camera/test_records.py", "engine/test_errors.py", "neuron/test_params.py")


def bounds(requirements):
    """Return the lower bounds of requirements by name."""
    return dict(requirement.split(">=") for requirement in requirements)


def test_the_oldest_versions_are_the_lower_bounds():
    extras = PROJECT["optional-dependencies"]
    lower = bounds([*PROJECT["dependencies"], *extras["cluster"], *extras["flow"], *extras["train"]])
    text = (ROOT / "tests" / "packaging" / "oldest.txt").read_text()
    oldest = dict(re.findall(r"^([\w-]+)==(\S+)$", text, re.MULTILINE))
    assert oldest.keys() - lower.keys() == {"torch"}
    assert {
        name: bound for name, bound in lower.items() if not f"{oldest[name]}.".startswith(f"{bound}.")
    } == {}
    dev = bounds(extras["dev"])
    assert {name for name in dev.keys() & lower.keys() if dev[name] != lower[name]} == set()


@pytest.mark.slow
def test_invalid_values_are_refused_without_assert_statements():
    files = [f"tests/{name}" for name in REFUSALS]
    command = [sys.executable, "-O", "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", *files]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
