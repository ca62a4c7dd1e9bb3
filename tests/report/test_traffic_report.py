"""Report page of a run of traffic."""

import base64
import csv
import json

import pytest
from support.runs import new_run

from lgmd_gym.report.page import write_outputs
from lgmd_gym.report.traffic import COLUMNS


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of three drives whose rows are replaced by given values."""
    folder = tmp_path_factory.mktemp("traffic") / "run"
    agents = ["no-brake", "ttc-oracle"]
    made = new_run(folder, suite="traffic-inattentive", kinds=["intersection"], agents=agents, seeds=1)
    assert made.play()
    made.folder.close()
    file = folder / "episodes.jsonl"
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    avoided = {"no-brake": False, "ttc-oracle": True}
    for row in rows:
        row |= {"threat": True, "avoidable": True, "avoided": True, "distance": 5e4}
        row |= {"avoided_by_brake": avoided[row["agent"]]}
        row |= {"needless_activations": 1, "speed_lost": 7.0, "brakes": 2, "caused": False}
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return folder


def test_report_has_the_tables_and_the_figure(run):
    files = write_outputs(run)
    assert [file.name for file in files] == ["episodes.csv", "summary.csv", "report.html"]
    page = (run / "report.html").read_text()
    assert all(f"<th>{name}</th>" in page for name in COLUMNS)
    assert "2 episodes in 1 case in the laboratory" in page
    assert "<td>ttc-oracle</td><td>50.0</td><td>2.0 [" in page
    assert "<td>14.0</td><td>2</td><td>1/1 [" in page
    assert "<td>intersection</td>" in page
    figure = run / "figures" / "avoided-against-speed-lost-clear"
    drawn = base64.b64encode(figure.with_suffix(".svg").read_bytes()).decode()
    assert f'<img src="data:image/svg+xml;base64,{drawn}"' in page
    assert figure.with_name(f"{figure.name}.svg").read_text().count("<svg") == 1
    with figure.with_name(f"{figure.name}.csv").open() as file:
        (line,) = csv.DictReader(file)
    assert (line["agent"], line["speed_lost_per_100km"], line["avoided"]) == ("ttc-oracle", "14.0000", "1")


def test_report_without_a_threat_has_no_figure(run, tmp_path):
    rows = [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]
    for name in ("run.toml", "run.json"):
        (tmp_path / name).write_bytes((run / name).read_bytes())
    changed = [row | {"avoidable": None, "avoided_by_brake": None, "distance": 0.0} for row in rows]
    (tmp_path / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in changed))
    assert len(write_outputs(tmp_path, report=False)) == 2
    write_outputs(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "<img" not in page
    assert not (tmp_path / "figures").exists()
    assert "<td>0.0</td><td>–</td><td>–</td>" in page
