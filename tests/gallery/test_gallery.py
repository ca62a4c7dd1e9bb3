"""Tests of the gallery: scenario cards, outcomes, the page and the command."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from lgmd_gym.benchmark.metrics import KEYS
from lgmd_gym.benchmark.task import Result
from lgmd_gym.cli import main as cli
from lgmd_gym.clips import VideoReader
from lgmd_gym.envs import FAMILIES
from lgmd_gym.envs.registration import RANDOM_TASKS, TRAFFIC_KINDS
from lgmd_gym.report.gallery.build import AgentOutcome, evaluate_agents, make_gallery, render_page
from lgmd_gym.report.gallery.cards import ROADS, camera_sheet, parse_docstring, road_sheet, scenario_cards

VOID = {"meta", "img", "br", "hr", "link", "input"}


class PageParser(HTMLParser):
    """Collect the identifiers, links and text of a page; raise for tags that are not closed in order."""

    def __init__(self, html):
        super().__init__()
        self.open, self.ids, self.links, self.text = [], [], [], []
        self.feed(html)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open += [] if tag in VOID else [tag]
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[name] for name in ("src", "poster", "href") if name in values]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def row(**values):
    no_fault = {"collision": False, "premature_brake": False, "false_activation": False}
    return dict.fromkeys(KEYS) | no_fault | {"threat": True, "avoided": True} | values


HIT = row(collision=True, avoided=False, relative_impact_speed=10.0)
NON_THREAT = row(threat=False, avoided=None)


@pytest.mark.parametrize(
    ("rows", "text", "passed"),
    [
        ([row(), row()], "avoided 2/2", True),
        ([HIT, row()], "avoided 1/2, contact at 36 km/h", False),
        ([row(avoided=False, premature_brake=True)], "avoided 0/1, braked too early", False),
        ([NON_THREAT, NON_THREAT], "false activations 0/2", True),
        ([NON_THREAT, NON_THREAT | {"false_activation": True}], "false activations 1/2", False),
        ([row(), NON_THREAT], "avoided 1/1, false activations 0/1", True),
        ([NON_THREAT | {"collision": True}], "false activations 0/1, contact 1/1", False),
        ([row(), row(error="Traceback")], "failed", False),
    ],
)
def test_outcome_of_rows(rows, text, passed):
    assert AgentOutcome.of(rows) == (text, passed, rows[0]["threat"])


def test_every_family_and_kind_of_traffic_has_a_card():
    cards = {card.name: card for card in scenario_cards()}
    assert set(cards) == {*FAMILIES, "RandomBraking", "RandomBrakingEasy", *TRAFFIC_KINDS}
    assert {name for name, card in cards.items() if card.traffic} == set(TRAFFIC_KINDS)
    docstring = cards["CCRs"].docstring
    assert "(Car-to-Car Rear stationary)" in docstring.summary
    assert [argument.name for argument in docstring.arguments][:2] == ["ego_speed", "lateral_offset"]
    assert docstring.arguments[0].default == "13.89"
    easy = cards["RandomBrakingEasy"].docstring
    assert "first trainings" in easy.summary
    defaults = {argument.name: argument.default for argument in easy.arguments}
    assert (defaults["weathers"], defaults["road"]) == ("('clear',)", "'smooth'")
    assert defaults["families"].startswith("('CCRs', ")


def test_outcomes_of_the_easy_task_are_of_its_levels(monkeypatch):
    cases = []
    monkeypatch.setattr(
        "lgmd_gym.report.gallery.build.run_task", lambda task: cases.append(task.case) or Result(row())
    )
    evaluate_agents(scenario_cards(("RandomBrakingEasy",))[0], ["no-brake"], seeds=2)
    assert [case.environment for case in cases] == ["RandomBraking"] * 2
    assert dict(cases[0].arguments) == RANDOM_TASKS["RandomBrakingEasy"].arguments


def test_the_page_groups_the_cards_and_links_every_section():
    cards = scenario_cards(("CCRs", "CCRm", "merge"))
    outcomes = {
        "CCRs": {"no-brake": AgentOutcome.of([HIT])},
        "CCRm": {"no-brake": AgentOutcome.of([NON_THREAT]), "<b>": AgentOutcome("failed", False, False)},
        "merge": {},
    }
    sheets = {"cameras": {"wide": {"clear": "camera-wide-clear.png", "fog": "camera-wide-fog.png"}}}
    html = render_page(cards, outcomes, sheets, "no-brake", seeds=2)
    page = PageParser(html)
    assert page.ids == ["threats", "CCRs", "non-threats", "CCRm", "traffic", "merge", "cameras"]
    assert {link for link in page.links if link.startswith("#")} == {
        "#threats", "#non-threats", "#traffic", "#cameras",
    }  # fmt: skip
    assert "media/camera-wide-fog.png" in page.links
    assert '<td class="failed">avoided 0/1, contact at 36 km/h</td>' in html
    assert '<td class="passed">false activations 0/1</td>' in html
    assert "&lt;b&gt;" in html
    assert "lgmd-gym drive traffic/merge --agent no-brake --live" in page.text


def test_an_item_without_docstring_is_rejected():
    with pytest.raises(ValueError, match="has no docstring"):
        parse_docstring(lambda: None)


def test_the_command_writes_a_page_with_videos(tmp_path, capsys):
    out = tmp_path / "gallery"
    assert cli.run(["gallery", "--out", str(out), "--families", "CCRs", "--seeds", "1"]) == 0
    assert "1/1  LGMD/CCRs-v0: avoided 1/1" in capsys.readouterr().out
    html = (out / "index.html").read_text()
    assert sorted(link for link in PageParser(html).links if not link.startswith("#")) == [
        "media/CCRs.jpg", "media/CCRs.jpg", "media/CCRs.mp4",
    ]  # fmt: skip
    video = VideoReader(out / "media" / "CCRs.mp4")
    assert video.fps == 15.0
    assert next(iter(video)).shape == (360, 640, 3)
    assert Image.open(out / "media" / "CCRs.jpg").size == (1280, 720)
    assert "http" not in html  # the page loads nothing from the network
    assert re.search(r"<th>no-brake</th><td class=\"failed\">avoided 0/1, contact at 50 km/h<", html)
    with pytest.raises(ValueError, match="already exists"):
        make_gallery(out)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--families", "CCRx"], "did you mean 'CCR"),
        (["--agent", "no-brak"], "did you mean 'no-brake'?"),
        (["--seeds", "0"], "seeds must be >= 1, got 0"),
        (["--out", "/proc/nowhere"], "'/proc/nowhere' cannot be"),
    ],
)
def test_invalid_input_gives_one_line_and_writes_nothing(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["gallery", *arguments]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_the_target_is_larger_in_a_narrower_camera():
    """The target is darker than the road."""
    sheet = camera_sheet()
    dark = [float((sheet[preset]["clear"] < 70).mean()) for preset in ("wide", "tele", "fovea")]
    assert dark == sorted(dark)
    assert dark[-1] > 4.0 * dark[0]


def test_road_frames_are_reproducible_and_differ_between_conditions():
    name = next(iter(ROADS))
    first, second = (road_sheet((name,), ("clear", "night"))[name] for _ in range(2))
    np.testing.assert_array_equal(first["clear"], second["clear"])
    assert first["night"].mean() < first["clear"].mean()
