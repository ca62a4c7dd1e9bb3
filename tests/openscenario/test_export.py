"""Export: files in the order of the schema, and the same episode after reading them back."""

import os
from dataclasses import fields, is_dataclass, replace
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree as ET

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.cli.main import run as run_command
from lgmd_gym.envs import FAMILIES, Actor, BrakingEnv, Scenario, Segment
from lgmd_gym.openscenario import read
from lgmd_gym.openscenario.export import export_case, scenario_xml

OPENDRIVE = os.environ.get("LGMD_OPENDRIVE_SCHEMAS")  # folder with opendrive_17_core.xsd of ASAM


def exported(folder, case):
    """Return the case after a round trip."""
    path, _ = export_case(case, folder / "case.xosc")
    (back,) = read(path).cases
    return back


def differences(one, other, place=""):
    """Yield the places at which two scenarios differ by more than 1e-9."""
    if is_dataclass(one):
        for item in fields(one):
            yield from differences(getattr(one, item.name), getattr(other, item.name), f"{place}.{item.name}")
    elif isinstance(one, tuple) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other, strict=True)):
            yield from differences(*pair, f"{place}[{number}]")
    elif isinstance(one, float):
        if not abs(one - other) <= 1e-9:
            yield place
    elif one != other:
        yield place


def outcome(scenario):
    """Return time, place and speeds at the end of an episode without braking."""
    env = BrakingEnv(scenario)
    env.reset(seed=5)
    steps, done = 0, False
    while not done:
        _, _, terminated, truncated, info = env.step([0.0])
        steps, done = steps + 1, terminated or truncated
    bodies = env.simulation.state.bodies[0]
    place = [bodies[name] for name in ("x", "y", "heading", "speed", "travelled")]
    return np.concatenate([[steps, info["impact_speed"], info["relative_impact_speed"]], *place])


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_survives_a_round_trip(tmp_path, family):
    case = Case("mine", family, "x")
    back = exported(tmp_path, case)
    assert back.name.startswith(f"case/{family}/v")
    np.testing.assert_allclose(outcome(back.scenario), outcome(case.scenario), rtol=0, atol=1e-6)
    found = list(differences(case.scenario, back.scenario))
    delayed = [".actors[0].profile[1].start"] if family == "BrakeRelease" else []
    assert found == delayed  # a segment that waits for the one before is exported with its real start


@pytest.mark.parametrize("name", ["quick/CCRs/v30"])
def test_frames_are_those_of_the_case(tmp_path, name):
    frames = []
    for item in ((case := find_case(name)), exported(tmp_path, case)):
        env = make_env(item, SensorConfig(), dict(item.arguments) | {"world": 8000, "include_frame": True})
        observation, _ = env.reset(seed=2)
        shots = [observation["frame"]]
        shots += [env.step([0.0])[0]["frame"] for _ in range(30)]
        frames.append(np.array(shots))
    np.testing.assert_array_equal(*frames)


RICH = Scenario(
    family="rich",
    ego_speed=0.0,
    duration=7.5,
    ego_profile=(Segment(start=0.0, acceleration=3.0, build_up=0.5, final_speed=9.0),),
    ego_length=4.6,
    ego_reference=1.3,
    actors=(
        Actor(gap=60.0, kind="pedestrian", heading=1.2, speed=1.0, lateral_offset=-3.0, shade=90, length=0.6),
        Actor(gap=30.0, kind="road_marking", height=0.0, width=40.0),
        Actor(gap=90.0, kind="bicycle", reference=0.5, speed=3.0),
        Actor(gap=95.0, kind="motorcycle", lateral_offset=2.0),
        Actor(gap=99.0, kind="box", lateral_offset=5.0, heading=-2.0),
    ),
)


def test_kinds_sizes_and_shades(tmp_path):
    from lgmd_gym.benchmark.case import scenario_case

    case = scenario_case("mine", "x", RICH, fcw_driver=True, weather="fog")
    back = exported(tmp_path, case)
    straight = replace(RICH, ego_reference=0.0, actors=tuple(replace(a, reference=0.0) for a in RICH.actors))
    assert list(differences(straight, back.scenario)) == []  # on a straight path, the reference has no effect
    assert back.fcw_driver
    assert dict(back.arguments)["weather"] == "fog"
    env = gym.make("LGMD/Scenario-v0", camera=None, **dict(back.arguments))
    env.reset(seed=0)


def test_files_have_the_order_of_the_schema():
    root = scenario_xml(RICH, "road.xodr", "night")
    assert [item.tag for item in root] == [
        "FileHeader", "ParameterDeclarations", "CatalogLocations", "RoadNetwork", "Entities", "Storyboard"
    ]  # fmt: skip
    assert [item.tag for item in root.find("Storyboard")] == ["Init", "Story", "StopTrigger"]
    assert [item.tag for item in root.find("Storyboard/Init/Actions")][:2] == ["GlobalAction", "Private"]
    assert len(root.findall("Entities/ScenarioObject")) == 6
    assert root.find(".//Event/Action/PrivateAction/LongitudinalAction/SpeedProfileAction") is not None
    for tag in ("Event", "Condition", "Maneuver", "ManeuverGroup", "Action"):
        assert all(item.get("name") for item in root.iter(tag)), tag
    assert "None" not in {value for item in root.iter() for value in item.attrib.values()}


@pytest.fixture(scope="module")
def schema():
    """The official schema of OpenSCENARIO 1.3.0, which ASAM's checker contains."""
    etree = pytest.importorskip("lxml.etree")
    folder = resources.files(pytest.importorskip("qc_openscenario"))
    return etree.XMLSchema(etree.parse(str(folder / "schema" / "1.3.0" / "OpenSCENARIO.xsd")))


@pytest.mark.parametrize("family", FAMILIES)
def test_exports_are_valid_against_the_official_schema(tmp_path, family, schema):
    etree = pytest.importorskip("lxml.etree")
    path, _ = export_case(Case("mine", family, "x"), tmp_path / "case.xosc")
    schema.assertValid(etree.parse(str(path)))


@pytest.mark.skipif(OPENDRIVE is None, reason="LGMD_OPENDRIVE_SCHEMAS names no folder with ASAM's schemas")
@pytest.mark.parametrize("family", FAMILIES)
def test_roads_are_valid_against_the_official_schema(tmp_path, family):
    xmlschema = pytest.importorskip("xmlschema")
    _, path = export_case(Case("mine", family, "x"), tmp_path / "case.xosc")
    xmlschema.XMLSchema11(Path(OPENDRIVE) / "opendrive_17_core.xsd").validate(str(path))


def test_the_command_writes_two_files(tmp_path, capsys):
    path = tmp_path / "case.xosc"
    assert run_command(["scenario", "export", "quick/CCRs/v30", "--to", str(path)]) == 0
    assert capsys.readouterr().out.split() == [str(path), str(path.with_suffix(".xodr"))]
    assert ET.parse(path).getroot().find("FileHeader").get("description") == "CCRs"
    first = path.read_bytes()
    path.unlink()
    path.with_suffix(".xodr").unlink()
    run_command(["scenario", "export", "quick/CCRs/v30", "--to", str(path)])
    assert path.read_bytes() == first  # reproducible


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["export", "quick/CCRs/v31", "--to", "a.xosc"],
            "environment or case 'quick/CCRs/v31'; did you",
        ),
        (["export", "quick/CCRs/v30"], "scenario export needs --to FILE.xosc"),
        (["export", "quick/CCRs/v30", "--to", "a.xml"], "the file must end in .xosc, got 'a.xml'"),
        (
            ["export", "quick/CCRs/v30", "--to", "old.xosc"],
            "'old.xosc' exists; choose another file or remove it",
        ),
        (["export", "quick/CCRs/v30", "--to", "no/a.xosc"], "'no/a.xosc' cannot be written: No such folder"),
        (["export", "a", "b", "--to", "a.xosc"], "scenario export needs one scenario, got 2"),
        (["check", "a.xosc", "--to", "b.xosc"], "scenario check writes no file, got --to 'b.xosc'"),
        (["check", "a.xosc"], "a.xosc cannot be read: No such file or directory"),
        (["check"], "scenario check needs a file or folder"),
    ],
)
def test_errors_are_one_line(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    Path("old.xosc").write_text("")
    assert run_command(["scenario", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error


def test_conditions_without_weather_are_refused(tmp_path):
    case = Case("mine", "CCRs", "x", (("weather", "low_sun"),))
    with pytest.raises(ValueError, match="OpenSCENARIO has no weather 'low_sun'; known: night"):
        export_case(case, tmp_path / "a.xosc")


def test_a_failed_export_leaves_no_file(tmp_path, monkeypatch):
    """The disk is full at the second file; the same command works once there is space."""
    case, path = find_case("quick/CCRs/v30"), tmp_path / "case.xosc"

    def full(file, text):
        if file.suffix == ".xodr":
            raise OSError(28, "No space left on device")
        file.write_text(text, "utf-8")

    with monkeypatch.context() as patch:
        patch.setattr("lgmd_gym.openscenario.export.replace_file", full)
        with pytest.raises(ValueError, match=r"case\.xosc' cannot be written: No space left on device"):
            export_case(case, path)
    assert list(tmp_path.iterdir()) == []
    assert [file.name for file in export_case(case, path)] == ["case.xosc", "case.xodr"]
