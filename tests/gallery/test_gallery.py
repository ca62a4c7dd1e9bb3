"""The gallery: films that play, verdicts that follow the rows, a page whose links all lead somewhere."""

import re

import pytest

from lgmd_gym.benchmark.rows import KEYS
from lgmd_gym.cli import main as cli
from lgmd_gym.envs import FAMILIES
from lgmd_gym.envs.traffic.registration import KINDS
from lgmd_gym.gallery.build import make_gallery
from lgmd_gym.gallery.docstrings import read
from lgmd_gym.gallery.page import is_good, page
from lgmd_gym.gallery.scenes import find_scenes, say
from lgmd_gym.gallery.stills import lens_sheet


def row(**values):
    calm = {"collision": False, "premature_brake": False, "false_activation": False}
    return dict.fromkeys(KEYS) | calm | {"threat": True, "avoided": True} | values


HIT = row(collision=True, avoided=False, relative_impact_speed=10.0)
QUIET = row(threat=False, avoided=None)


@pytest.mark.parametrize(
    ("rows", "words", "good"),
    [
        ([row(), row()], "avoided 2/2", True),
        ([HIT, row()], "avoided 1/2, contact at 36 km/h", False),
        ([row(avoided=False, premature_brake=True)], "avoided 0/1, braked too early", False),
        ([QUIET, QUIET], "needless braking 0/2", True),
        ([QUIET, QUIET | {"false_activation": True}], "needless braking 1/2", False),
        ([row(), QUIET], "avoided 1/1, needless braking 0/1", True),
        ([QUIET | {"collision": True}], "needless braking 0/1, contact 1/1", False),
        ([row(), row(error="Traceback")], "failed", False),
    ],
)
def test_verdicts_in_words(rows, words, good):
    assert say(rows) == words
    assert is_good(words) == good


def test_every_family_and_kind_has_a_scene_with_its_docstring():
    scenes = {scene.name: scene for scene in find_scenes()}
    assert set(scenes) == {*FAMILIES, "RandomBraking", *KINDS}
    about = scenes["CCRs"].about
    assert about.lead == "Approach a standing car (Car-to-Car Rear stationary)."
    assert [argument.name for argument in about.arguments][:2] == ["ego_speed", "lateral_offset"]
    assert about.arguments[0].default == "13.89"
    html = page(list(scenes.values()), {name: {"no-brake": "avoided 0/1"} for name in scenes}, {}, "x", 1)
    for scene in scenes.values():
        assert f'<article id="{scene.name}">' in html


def test_a_docstring_is_needed():
    with pytest.raises(ValueError, match="has no docstring"):
        read(lambda: None)


def test_gallery_from_start_to_end(tmp_path, capsys):
    out = tmp_path / "gallery"
    assert cli.run(["gallery", "--out", str(out), "--families", "CCRs", "--seeds", "1"]) == 0
    assert "1/1  LGMD/CCRs-v0: avoided 1/1" in capsys.readouterr().out
    html = (out / "index.html").read_text()
    links = re.findall(r'(?:src|poster)="([^"]+)"', html)
    assert len(links) == 3
    assert all((out / link).stat().st_size > 5_000 for link in links)
    assert "http" not in html  # nothing is fetched
    assert ">contact at 50 km/h<" in html.replace("avoided 0/1, ", "")
    with pytest.raises(ValueError, match="exists and is kept"):
        make_gallery(out, (), "no-brake", 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--families", "CCRx"], "did you mean 'CCR"),
        (["--agent", "no-brak"], "did you mean 'no-brake'?"),
        (["--seeds", "0"], "seeds must be >= 1, got 0"),
        (["--out", "/proc/nowhere"], "cannot be made"),
    ],
)
def test_bad_input_leaves_nothing_behind(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["gallery", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_lenses_show_the_same_target_larger():
    """The target is darker than the road behind it; a narrower lens shows more of it."""
    sheet = lens_sheet()
    dark = [float((sheet[lens]["clear"] < 70).mean()) for lens in ("wide", "tele", "fovea")]
    assert dark == sorted(dark)
    assert dark[-1] > 4.0 * dark[0]
