"""The report page and its figures, from hand-made rows."""

import csv
import json
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from lgmd_gym.report import write_report
from lgmd_gym.report.figures import MAX_SPEEDS, avoidance_figure, impact_points
from lgmd_gym.report.svg import file_text, label, new_panel, ticks

SVG = "{http://www.w3.org/2000/svg}"


class Page(HTMLParser):
    """Collects start tags with their attributes, and end tags."""

    VOID = ("meta", "img", "link", "br", "input")

    def __init__(self, text):
        super().__init__()
        self.tags, self.open = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def values(self, name):
        return {attrs[name] for _, attrs in self.tags if name in attrs}


def test_page_is_complete_without_network_or_script(page):
    parsed = Page(page)
    assert parsed.open == []
    assert "{{" not in page
    assert not {"link", "iframe", "object"} & {tag for tag, _ in parsed.tags}
    assert [attrs for tag, attrs in parsed.tags if tag in ("script", "style") and attrs] == []
    assert not re.search(r"https?:|url\(|@import|fetch\(|XMLHttpRequest", page.split("<h2>Configuration")[0])
    assert all(value.startswith("data:image/") for value in parsed.values("src"))
    assert page.count("<script>") == 1
    assert page.index("<script>") > page.index("<h2>Configuration")


def test_every_figure_is_a_file_with_data_and_a_link(page, report_folder):
    links = Page(page).values("href")
    assert {"episodes.csv", "summary.csv"} < links
    files = {f"figures/{file.name}" for file in (report_folder / "figures").iterdir()}
    assert files == links - {"episodes.csv", "summary.csv"}
    stems = {file.rpartition(".")[0] for file in files}
    assert {f"figures/{name}-clear" for name in ("impact-speed", "avoidance", "grids")} < stems
    assert files == {f"{stem}.{suffix}" for stem in stems for suffix in ("svg", "csv")}


@pytest.mark.parametrize("name", ["impact-speed-clear", "avoidance-clear", "grids-clear", "differences"])
def test_figure_files_are_valid(report_folder, name):
    root = ElementTree.parse(report_folder / "figures" / f"{name}.svg").getroot()
    assert root.tag == f"{SVG}svg"
    with (report_folder / "figures" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert lines
    assert all(None not in line and None not in line.values() for line in lines)
    if name.startswith("grids"):
        assert len(root.findall(f".//{SVG}rect")) == 1 + len(lines)  # the background and the cells
        assert len(root.findall(f".//{SVG}g/{SVG}title")) == len(lines)


def test_marks_have_hover_titles(page):
    assert "CCRs at 50 km/h: contact in 5 of 5 threats, impact speed mean 50.0, highest 50.0 km/h" in page
    assert "CCRs at 50 km/h: contact in 1 of 5 threats, impact speed mean 10.0, highest 50.0 km/h" in page
    assert "no-brake: avoided 0 of " in page


def test_elements_have_the_attributes_of_the_filters(page, user_agent):
    parsed = Page(page)
    assert parsed.values("data-agent") == {"no-brake", user_agent, "ttc-oracle"}
    assert parsed.values("data-condition") == {"clear"}
    assert {"CCRs", "CCRm", "CCRb", "CCCscp"} < parsed.values("data-family")
    assert '<th data-agent="ttc-oracle">ttc-oracle</th>' in page
    tables = [attrs for tag, attrs in parsed.tags if tag == "table"]
    assert tables
    assert all(attrs.get("class") == "sortable" for attrs in tables)


def test_agent_names_are_escaped(page, report_folder, user_agent):
    assert "<b>" not in page.replace("<b>No camera frames", "")
    assert "&lt;b&gt;&amp;" in page
    svg = (report_folder / "figures" / "impact-speed-clear.svg").read_text(encoding="utf-8")
    assert user_agent in "".join(ElementTree.fromstring(svg).itertext())


def test_conclusion_comes_first(page):
    first = page[page.index("<ul") : page.index("</ul>")]
    assert first.startswith('<ul class="conclusion"><li>The run contains 531 episodes of suite ncap2023')
    assert first.count("<li>") == 3
    assert "no-brake</dt><dd>Never brakes.</dd>" in page
    assert "which was not loaded." in page


def test_styles_for_dark_pages_paper_and_narrow_screens(page):
    style = page.split("<style>")[1].split("</style>")[0]
    assert "@media screen and (prefers-color-scheme:dark)" in style
    assert "@media print" in style
    assert 'name="viewport" content="width=device-width' in page
    assert page.count('<div class="scroll"><table') == page.count("<table")


def test_a_second_report_replaces_the_first(report_folder, page):
    before = {file.name: file.read_bytes() for file in (report_folder / "figures").glob("*.csv")}
    write_report(report_folder)
    assert {file.name: file.read_bytes() for file in (report_folder / "figures").glob("*.csv")} == before
    assert list(report_folder.rglob("*.part")) == []


def test_report_without_a_common_episode_of_two_agents(report_folder, user_agent, tmp_path):
    """The only other agent failed in every episode: no paired differences, but the page exists."""
    rows = [json.loads(line) for line in (report_folder / "episodes.jsonl").read_text().splitlines()]
    failed = [row | {"error": "KeyError: 'x'"} if row["agent"] == user_agent else row for row in rows]
    for name in ("run.toml", "run.json"):
        (tmp_path / name).write_text((report_folder / name).read_text())
    (tmp_path / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in failed))
    assert "Paired differences" in (report_folder / "report.html").read_text()
    assert "Paired differences" not in write_report(tmp_path).read_text()


def test_impact_points_of_many_speeds_are_grouped():
    row = {"agent": "a", "fcw_driver": False, "threat": True, "error": None, "collision": False}
    rows = [
        row | {"family": "F", "ego_speed": kmh / 3.6, "impact_speed": None} for kmh in range(MAX_SPEEDS + 1)
    ]
    points = impact_points(rows, ["a"], "clear")
    assert [point.speed for point in points] == [0, 5, 10, 15, 20, 25]
    assert sum(point.threats for point in points) == MAX_SPEEDS + 1
    assert len(impact_points(rows[:-1], ["a"], "clear")) == MAX_SPEEDS
    failed = [item | {"error": "x"} for item in rows]
    assert impact_points(failed, ["a"], "clear") == []


def test_no_avoidance_figure_without_both_kinds_of_episodes():
    assert avoidance_figure([], ["a"], "clear") is None


def test_ticks():
    assert ticks(104.0) == [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]
    assert ticks(10.4) == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]


def test_texts_that_xml_does_not_allow_are_replaced():
    panel = new_panel("a\x00<b>", (10.0, 10.0), agent="\ud800")
    label(panel, 0, 0, "\x1b")
    root = ElementTree.fromstring(file_text("\x00", [panel], ["\x01"]))
    assert "\ufffd" in "".join(root.itertext())
