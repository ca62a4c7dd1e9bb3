"""The script docs/examples/failure_maps.py and its modules: maps, cells, figure and options."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from support.examples import load

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.camera import CameraParams
from lgmd_gym.neuron import LGMDParams


def test_failure_maps(tmp_path, capsys, monkeypatch):
    """The maps of an oracle follow from its threshold; roads, textures and worlds reach the tasks."""
    script, picture, agent = load("failure_maps"), tmp_path / "maps.png", "ttc-oracle:ttc=4.5"
    played, play = [], script.play
    monkeypatch.setattr(script, "play", lambda tasks, *rest: played.extend(tasks) or play(tasks, *rest))
    options = f"--agents {agent} --planes vibration brake curve --worlds 2 --roads still rough"
    grids = "--textures 1 2.5 --decelerations 5 9.5 --radii 60 inf --speeds 20 80"
    vibration, brake, curve = script.main([*options.split(), *grids.split(), "--to", str(picture)])

    def counts(rates):
        return [[rate and (rate.k, rate.n) for rate in row] for row in rates]

    # At 80 km/h, 44 m are left 2 s before contact. Braking needs 49 m at 5 m/s² and 26 m at 9.5 m/s².
    assert counts(brake["ttc-oracle"]) == [[(2, 2), (2, 2)], [(0, 2), (2, 2)]]
    assert counts(curve["ttc-oracle"]) == [[(2, 2), (2, 2)], [None, (2, 2)]]
    assert counts(brake[agent]) == counts(vibration[agent]) == [[(0, 2)] * 2] * 2  # premature
    seen = {
        (task.arguments["road"], task.sensor_config.camera[0]["texture"], task.world)
        for task in played
        if task.agent == agent and task.road
    }
    assert seen == set(product(("still", "rough"), (1.0, 2.5), (8000, 8001)))
    assert {task.arguments["condition"] for task in played} == {"mixed"}
    lines = capsys.readouterr().out.splitlines()
    assert "| ego speed [km/h] \\ radius [m] | 60 | ∞ |" in lines
    assert "| 80 | – | 2/2 [34–100] |" in lines
    assert picture.stat().st_size > 10_000
    options = "--agents ttc-oracle:ttc=0 --planes width --widths 1 --speeds 20 --worlds 1"
    for wrong, message in (
        ("", "ttc must be a number > 0, got 0"),
        ("--agents ttc-oracle --bound stopping-zone", "--bound must use no camera, got stopping-zone"),
        ("--agents ttc-oracle --worlds 1001", "worlds must be test worlds, 8000 to 8999"),
        ("--agents ttc-oracle --worlds 0", "worlds must be test worlds, 8000 to 8999"),
        ("--agents ttc-oracle --planes vibration --textures -1", "camera texture must be in [0, 5]"),
        ("--agents ttc-oracle --widths 0.1", "width must be in [0.2, 4] m, got 0.1"),
    ):
        with pytest.raises(SystemExit):
            script.main([*options.split(), *wrong.split()])
        assert message in capsys.readouterr().err


def test_the_documented_figure_has_four_planes():
    chosen = load("failure_maps").read_options([])
    assert list(chosen.planes) == ["vibration", "width", "brake", "curve"]


def test_failure_maps_cells(monkeypatch):
    script, planes = load("failure_maps"), load("failure_map_planes")
    assert load("failure_map_figure").edges(np.array([[0.9, 0.8], [np.nan, 1.0]])) == [
        ([1, 1], [0, 1]),
        ([1, 2], [1, 1]),
    ]
    own = SensorConfig().for_agent(make_agent("stopping-zone"))
    changed = script.sensors_of("stopping-zone", 2.5)
    expected = [CameraParams.make(camera, texture=2.5) for camera in own.camera]
    assert [CameraParams.make(camera) for camera in changed.camera] == expected
    assert planes.width_cell(0.3, 36.0, 8000).case.scenario.actors[0].width == 0.3
    box = planes.height_cell(0.5, 36.0, 8000).case.scenario.actors[0]
    assert (box.kind, box.width, box.height) == ("box", 2.0, 0.5)
    right, left = (planes.curve_cell(100.0, 36.0, world).case.scenario for world in (8000, 8001))
    assert [bend.curvature for bend in (*right.ego_path, *left.ego_path)] == [-0.01, 0.01]
    assert right.road.bends == right.ego_path
    # 54.16 m from centre to centre along the arc: chord 2 · 100 m · sin(0.2708), heading 0.5416 rad.
    target = left.actors[0]
    assert target.heading == pytest.approx(0.54162, abs=1e-4)
    assert target.lateral_offset == pytest.approx(100.0 * (1.0 - np.cos(0.541615)), abs=1e-3)
    assert target.gap + 4.1615 == pytest.approx(100.0 * np.sin(0.541615), abs=1e-3)
    assert planes.curve_cell(100.0, 72.0, 8000) is not None  # 4 m/s²
    assert planes.curve_cell(100.0, 72.5, 8000) is None
    own = SimpleNamespace(camera="fovea", neuron=LGMDParams.off_only(), include_frame=True)
    monkeypatch.setattr(script, "make_agent", lambda agent: own)
    expected = SensorConfig([{"name": "fovea", "texture": 2.5}], own.neuron, include_frame=True)
    assert script.sensors_of("own", 2.5) == expected
