"""A run folder with hand-made rows, and its report."""

import json

import pytest
from support.rows import suite_rows

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.report import write_report

AGENT = 'cow_rules:Mine:name=<b>&"moo"</b>'  # an agent from outside the package, never loaded


@pytest.fixture(scope="session")
def report_folder(tmp_path_factory):
    """Return a folder with ncap2023 and three agents, of which `AGENT` has contact at overlaps of 50 %."""
    folder = tmp_path_factory.mktemp("run")
    config = RunConfig(suite="ncap2023", agents=("no-brake", AGENT, "ttc-oracle"), seeds=1, worlds=0)
    config.save(folder)
    rows = []
    for agent in config.agents:
        driver = {case.name: case.fcw_driver for case in SUITES["ncap2023"].cases}
        for row in suite_rows(
            "ncap2023",
            lambda case, _, agent=agent: (
                agent == "no-brake" or (agent == AGENT and case.endswith("overlap50"))
            ),
        ):
            threat = "CCRm/v30" not in row["case"]
            contact = row["collision"] and threat
            values = {
                "agent": agent,
                "suite": "ncap2023",
                "fcw_driver": driver[row["case"]],
                "threat": threat,
            }
            flags = {"collision": contact, "avoided": not contact if threat else None}
            flags |= {"premature_brake": False, "false_activation": not threat and agent == AGENT}
            speeds = {"speed_reduction": 1.0 if threat else None, "peak_deceleration": 9.0}
            rows.append(row | values | flags | speeds)
    text = "".join(json.dumps(row) + "\n" for row in rows)
    (folder / "episodes.jsonl").write_text(text, encoding="utf-8")
    (folder / "run.json").write_text(json.dumps({"complete": True}), encoding="utf-8")
    write_report(folder)
    return folder


@pytest.fixture
def user_agent():
    return AGENT


@pytest.fixture(scope="session")
def page(report_folder):
    return (report_folder / "report.html").read_text(encoding="utf-8")
