"""The files for GitHub parse, and agree with the README and the classifiers of pyproject.toml."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
GITHUB = ROOT / ".github"
WORKFLOWS = ("docs", "publish", "test")
FORMS = ("bug", "feature", "question")
CLASSIFIERS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["classifiers"]
SYSTEMS = {"ubuntu-latest": "Linux", "macos-latest": "MacOS", "windows-latest": "Windows"}
ADDRESS = "https://example.org/owner/name"


def workflow(name):
    return yaml.safe_load((GITHUB / "workflows" / f"{name}.yml").read_text())


def commands(job):
    return {step.get("name", step["run"]): step for step in job["steps"] if "run" in step}


def readme_test_command():
    (line,) = re.findall(r"^python3 -m venv.*pytest$", (ROOT / "README.md").read_text(), re.MULTILINE)
    return line


def test_there_are_no_other_files():
    assert {path.stem for path in (GITHUB / "workflows").iterdir()} == set(WORKFLOWS)
    assert {path.stem for path in (GITHUB / "ISSUE_TEMPLATE").iterdir()} == {*FORMS, "config"}
    assert (GITHUB / "pull_request_template.md").read_text().startswith("## ")


@pytest.mark.parametrize("name", WORKFLOWS)
def test_workflows_have_the_keys_that_github_requires(name):
    content = workflow(name)
    assert content.keys() >= {"name", True, "permissions", "jobs"}  # YAML 1.1 reads `on` as True
    assert content["permissions"] == {"contents": "read"}
    for job in content["jobs"].values():
        assert {"runs-on", "steps"} <= job.keys()
        assert set(job.get("needs", "").split()) <= content["jobs"].keys()
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step)
            assert re.fullmatch(r"[\w-]+/[\w-]+@(v\d+|release/v1)", step.get("uses", "a/b@v1"))


@pytest.mark.parametrize("name", FORMS)
def test_issue_forms_have_the_keys_that_github_requires(name):
    form = yaml.safe_load((GITHUB / "ISSUE_TEMPLATE" / f"{name}.yml").read_text())
    assert form.keys() == {"name", "description", "labels", "body"}
    ids = [field["id"] for field in form["body"]]
    assert len(set(ids)) == len(ids)
    assert all(field["type"] in ("textarea", "input") for field in form["body"])
    assert all(field["attributes"]["label"] for field in form["body"])
    assert any(field.get("validations") == {"required": True} for field in form["body"])


def test_the_matrix_has_the_classified_versions_on_each_system():
    test = workflow("test")["jobs"]["test"]
    matrix = test["strategy"]["matrix"]
    versions = [item.rpartition(" ")[2] for item in CLASSIFIERS if re.search(r"Python :: 3\.\d+$", item)]
    assert matrix["python"] == versions
    assert set(matrix["os"]) == set(SYSTEMS)
    systems = {item.rpartition(" ")[2] for item in CLASSIFIERS if item.startswith("Operating System")}
    required = re.fullmatch(r"\$\{\{ matrix\.os != '([\w-]+)' \}\}", test["continue-on-error"])[1]
    assert systems == {SYSTEMS[required]}


def test_the_workflow_runs_the_test_command_of_the_readme():
    steps = commands(workflow("test")["jobs"]["test"])
    posix, windows = (
        steps["Test command of the README"],
        steps["Test command of the README, with the folders of Windows"],
    )
    assert posix["run"] == readme_test_command()
    assert posix["if"] == "runner.os != 'Windows'"
    assert windows["run"] == posix["run"].replace(".venv/bin/", ".venv/Scripts/").replace("python3", "python")
    assert windows["if"] == "runner.os == 'Windows'"


def test_slow_tests_and_lint_run_once():
    steps = commands(workflow("test")["jobs"]["test"])
    checks = [line.removesuffix(" &") for line in (ROOT / ".ci" / "run").read_text().splitlines()]
    for name in ("Slow tests", "Lint, spelling and types"):
        assert steps[name]["if"] == "matrix.os == 'ubuntu-latest' && matrix.python == '3.11'"
        assert [line for line in steps[name]["run"].split(" && ") if line not in checks] == []
    install, build = commands(workflow("docs")["jobs"]["build"])
    assert build in checks
    (line,) = re.findall(r"`(\.venv/bin/pip [^`]*docs/_build)`", (ROOT / "README.md").read_text())
    assert line.partition(" && ")[0] == install.partition(" && ")[2]  # as printed in the README


def test_the_extra_of_the_documentation_has_what_the_notebooks_import():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert "lgmd-gym[train]" in extras["docs"]


def test_only_publishing_jobs_get_a_token_and_they_build_nothing():
    assert workflow("publish")[True] == {"push": {"tags": ["v*"]}}
    for name in WORKFLOWS:
        for key, job in workflow(name)["jobs"].items():
            assert ("id-token" in job.get("permissions", {})) == (key == "publish")
            assert key != "publish" or not any("run" in step for step in job["steps"])


def test_the_tag_is_compared_with_the_version():
    (line,) = [
        step["run"] for name, step in commands(workflow("publish")["jobs"]["build"]).items() if "tag" in name
    ]
    version = re.search(r'"(.*)"', (ROOT / "lgmd_gym" / "_version.py").read_text().splitlines()[-1])[1]
    for tag, status in ((f"v{version}", 0), ("v999", 1), (version, 1)):
        done = subprocess.run(
            ["bash", "-c", line], cwd=ROOT, env={"GITHUB_REF_NAME": tag, "PATH": "/usr/bin:/bin"}
        )
        assert done.returncode == status


def test_links_of_the_package_page_are_absolute(tmp_path):
    for name in ("README.md", "pyproject.toml"):
        (tmp_path / name).write_text((ROOT / name).read_text())
    script = [sys.executable, str(GITHUB / "absolute_links.py")]
    for _ in range(2):  # a second run changes nothing
        subprocess.run([*script, f"{ADDRESS}/", "v1"], cwd=tmp_path, check=True)
    targets = re.findall(r"\]\(([^)]+)\)", (tmp_path / "README.md").read_text())
    assert [target for target in targets if not target.startswith("https://")] == []
    ours = [target.removeprefix(ADDRESS) for target in targets if target.startswith(ADDRESS)]
    assert "/raw/v1/docs/approach.gif" in ours
    files = [path.split("/v1/")[1].partition("#")[0] for path in ours]  # headings: tests/docs/test_docs.py
    assert [file for file in files if not (ROOT / file).is_file()] == []
    urls = tomllib.loads((tmp_path / "pyproject.toml").read_text())["project"]["urls"]
    assert urls["Repository"] == ADDRESS
    refused = subprocess.run([*script, "name"], capture_output=True, text=True, cwd=tmp_path)
    assert refused.returncode == 1
    assert refused.stderr == "usage: python .github/absolute_links.py https://HOST/OWNER/NAME TAG\n"
