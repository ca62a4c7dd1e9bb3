"""The script that plays the suites of the documentation, and the tables of the pages that it fills."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.examples import load
from support.rows import threat_row

from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark.run_folder import StoredRun

USUAL = {"premature_brake": False, "speed_reduction": 5.0, "fcw_driver": False}


@pytest.fixture(scope="module")
def script():
    return load("results")


def stored(suite, cases, twin=()):
    """Return a run with one row per case: whether it is avoided; those of `twin` are false activations."""
    config = RunConfig(suite=suite, agents=("a",), seeds=1)
    rows = [threat_row("a", f"{suite}/{case}", avoided=avoided, **USUAL) for case, avoided in cases.items()]
    for row in rows:
        row["false_activation"] = any(name in row["case"] for name in twin)
    return StoredRun(config, rows, False)


def found(script, runs):
    return {score[:4]: (score.rate.k, score.rate.n) for score in script.scores_of(runs)}


def test_scores_by_family_with_those_that_are_due_to_the_target(script):
    cases = {"CCRs/v20": True, "CCRs/v40": False, "CCCscp/v20/target20": True}
    run = stored("ncap2023", cases)
    run.rows.append(threat_row("a", "ncap2023/CCRs/v50", avoided=True, **USUAL | {"fcw_driver": True}))
    twin = stored("ncap2023-without-target", cases, ["CCCscp"])
    twin.rows.append(threat_row("a", "ncap2023/CCRs/v50", **USUAL | {"fcw_driver": True}))
    for row in twin.rows:
        row |= {"threat": False, "avoided": None, "false_activation": bool(row["false_activation"])}
    assert found(script, {"ncap2023": run, "ncap2023-without-target": twin}) == {
        ("ncap2023", "all", "a", "avoided"): (2, 3),
        ("ncap2023", "all", "a", "warned"): (1, 1),
        ("ncap2023", "all", "a", "detected"): (1, 3),
        ("ncap2023", "CCRs", "a", "avoided"): (1, 2),
        ("ncap2023", "CCRs", "a", "warned"): (1, 1),
        ("ncap2023", "CCRs", "a", "detected"): (1, 2),
        ("ncap2023", "CCCscp", "a", "avoided"): (1, 1),
        ("ncap2023", "CCCscp", "a", "detected"): (0, 1),
        ("ncap2023-without-target", "all", "a", "false"): (1, 3),
        ("ncap2023-without-target", "CCRs", "a", "false"): (0, 2),
        ("ncap2023-without-target", "CCCscp", "a", "false"): (1, 1),
    }


def test_scores_of_the_regulation_are_stated_per_case(script):
    scores = found(script, {"r152": stored("r152", {"CCRs/v20": True, "CCRs/v40": False})})
    assert scores["r152", "CCRs/v20", "a", "avoided"] == (1, 1)
    assert scores["r152", "CCRs/v40", "a", "avoided"] == (0, 1)


def test_pages_have_the_scores_of_the_files(script):
    """All tables on the pages are filled from the files."""
    assert script.fill_pages(check=True) == []


def test_blocks_are_filled_and_the_rest_of_a_page_stays(script):
    rate = script.Rate(1, 2, 0.05, 0.95)
    scores = [script.Score("r152", group, "a", "avoided", rate) for group in ("all", "CCRs/v20")]
    drives = [script.Drives("traffic", "a", 200.0, 4, 5.5, 51.2, 30.0, 4, 3, 2, 1)]

    def make(kind, arguments):
        return script.table(kind, arguments, scores, drives)

    text = "one\n<!-- table: {} -->\nold\n<!-- end of table -->\ntwo\n"
    page = script.filled(text.format("avoided r152 : a"), make)
    assert page.splitlines()[1:6] == [
        "<!-- table: avoided r152 : a -->",
        "",
        "| agent | r152 |",
        "| --- | --- |",
        "| `a` | 1/2 [5–95] |",
    ]
    assert page.startswith("one\n")
    assert page.endswith("<!-- end of table -->\ntwo\n")
    assert script.filled(page, make) == page
    assert "| CCRs/v20 | 1/2 [5–95] |" in script.filled(text.format("cases r152"), make)
    line = script.filled(text.format("traffic"), make).splitlines()[5]
    assert line == "| traffic | `a` | 200 | 20 [6–51] | 15 | 3/4 | 2 | 1 |"
    with pytest.raises(ValueError, match="unknown kind of table 'avoid'; did you mean 'avoided'"):
        script.filled(text.format("avoid r152"), make)
    with pytest.raises(ValueError, match="unknown agent of the results 'b'"):
        script.filled(text.format("avoided r152 : b"), make)
    with pytest.raises(ValueError, match="unknown suite of the results 'r125'; did you mean 'r152'"):
        script.filled(text.format("cases r125"), make)
    with pytest.raises(ValueError, match="unknown agent of the results 'b'"):
        script.filled(text.format("traffic : b"), make)
    with pytest.raises(ValueError, match="requires suites"):
        script.filled(text.format("cases : a"), make)
    assert "| `a` | – |" in script.filled(text.format("false r152"), make)


def test_the_table_of_the_start_page_has_a_line_per_idea(script):
    rate = script.Rate(3, 4, 0.3, 0.95)
    scores = [
        script.Score(suite, "all", agent, measure, rate)
        for agent in script.IDEAS
        for suite, measure in script.SUMMARY.values()
    ]
    drives = [script.Drives("traffic", "stopping-zone", 200.0, 4, 5.5, 51.2, 30.0, 4, 3, 2, 1)]
    heads, _, *lines = script.table("summary", [], scores, drives)
    assert len(lines) == len(script.IDEAS)
    assert len({line.count("|") for line in (heads, *lines)}) == 1
    assert lines[1].startswith("| `stopping-zone` | fields that follow the stopping distance | 3 of 4 |")
    assert " | 4 in 200 km | 17 LGMDs" in lines[1]
    assert " | – | " in lines[0]


def test_files_keep_the_scores(script, tmp_path, monkeypatch):
    monkeypatch.setattr(script, "SCORES", tmp_path / "results" / "scores.csv")
    monkeypatch.setattr(script, "TRAFFIC", tmp_path / "results" / "traffic.csv")
    scores = [script.Score("r152", "all", "b:x=1,y=2", "avoided", script.Rate(1, 3, 0.061, 0.792))]
    drives = [script.Drives("traffic", "a", 200.5, 4, 5.5, 51.2, 30.0, 4, 3, 2, 1)]
    script.write_scores(scores, "abc123")
    script.write_traffic(drives, "abc123")
    assert (script.read_scores(), script.read_traffic()) == (scores, drives)
    assert script.SCORES.read_text().endswith(",abc123\n")
    more = [item._replace(agent=agent) for agent in ("stopping-zone", "no-brake") for item in scores]
    script.write_scores(more, "def456")
    again = [more[1]._replace(rate=script.Rate(2, 3, 0.2, 0.9)), more[1]._replace(suite="ncap2023")]
    script.write_scores(again, "fed789")
    assert script.read_scores() == [again[0], more[0], *scores, again[1]]
    commits = [line.rpartition(",")[2] for line in script.SCORES.read_text().splitlines()]
    assert commits == ["commit", "fed789", "def456", "abc123", "fed789"]
    script.SCORES.write_text("# docs/experiments/results.py, commit abc123\nsuite\nr152\n")
    with pytest.raises(ValueError, match=r"scores.csv' has another format; remove it and collect"):
        script.write_scores(scores, "abc123")


def test_a_suite_is_collected_with_its_twin(script):
    script.check_twins(["r152", "ncap2023", "ncap2023-without-target"])
    for alone in ("ncap2023", "ncap2023-without-target"):
        with pytest.raises(ValueError, match="both 'ncap2023' and 'ncap2023-without-target'; play the other"):
            script.check_twins([alone])


def test_own_agents_are_played_and_printed(script, tmp_path, monkeypatch, capsys):
    """A suite whose folder exists is not played again; an incomplete one is refused."""
    suite = tmp_path / "mine.toml"
    suite.write_text('name = "mine"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [20]\n')
    monkeypatch.setattr(script, "SEEDS", {"mine": 1})
    config = RunConfig(suite=str(suite), agents=("ttc-oracle",), seeds=1, worlds=0)
    monkeypatch.setattr(script, "config_of", lambda name, agents: config)
    for _ in range(2):
        script.play(tmp_path / "runs", ["ttc-oracle"], ["mine"])
    monkeypatch.setattr(script, "config_of", lambda name, agents: replace(config, agents=tuple(agents)))
    with pytest.raises(ValueError, match="has the agents ttc-oracle, not no-brake; choose another folder"):
        script.play(tmp_path / "runs", ["no-brake"], ["mine"])
    monkeypatch.setattr("sys.argv", ["results.py", "collect", str(tmp_path / "runs"), "--print"])
    script.main()
    assert "| `ttc-oracle` | 1/1 [21–100] |" in capsys.readouterr().out
    rows = (tmp_path / "runs" / "mine" / "episodes.jsonl").read_text()
    (tmp_path / "runs" / "mine" / "episodes.jsonl").write_text(rows[: rows.index("\n") - 5])
    with pytest.raises(ValueError, match="lacks 2 episodes; complete it with lgmd-gym bench --resume"):
        script.read(tmp_path / "runs")
    with pytest.raises(ValueError, match=r"no runs in .*; play them first with results.py run"):
        script.read(tmp_path)


def test_runs_with_failed_episodes_or_other_twins_are_refused(script, monkeypatch, tmp_path):
    run = stored("ncap2023", {"CCRs/v20": True})
    twin = stored("ncap2023-without-target", {"CCRs/v20": True})
    runs = {"ncap2023": run, "ncap2023-without-target": twin}
    for name in runs:
        (tmp_path / name).mkdir()
    monkeypatch.setattr(script, "read_run", lambda folder: runs[folder.name])
    monkeypatch.setattr(script, "make_plan", lambda config: SimpleNamespace(total=1))
    assert script.read(tmp_path) == runs
    runs["ncap2023-without-target"] = twin._replace(config=replace(twin.config, agents=("b",)))
    with pytest.raises(ValueError, match="differ in more than the suite"):
        script.read(tmp_path)
    run.rows[0]["error"] = "ValueError: x"
    with pytest.raises(ValueError, match="has 1 failed episode; correct the agent"):
        script.read(tmp_path)
