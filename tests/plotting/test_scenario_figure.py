"""The figure of a scenario: positions, headings and speeds computed by hand."""

import numpy as np
import pytest

from lgmd_gym.camera import objects
from lgmd_gym.envs import Actor, RoadPlan, Scenario, Segment, make_scenario
from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.envs.motion import _LONG_M, _TALL_M, is_truck, record_motion
from lgmd_gym.plotting.figures import scenario_figure

BRAKING = Segment(start=1.0, acceleration=-2.0, final_speed=4.0)
PASS = Scenario(
    family="x",
    ego_speed=10.0,
    duration=2.0,
    actors=(
        Actor(gap=20.0, lateral_offset=3.5, speed=6.0, profile=(BRAKING,), length=5.0, width=2.0),
        Actor(gap=50.0, lateral_offset=-3.5, kind="road_marking", height=0.0),
    ),
)


@pytest.mark.parametrize(
    ("size", "truck"),
    [
        ({}, False),
        ({"length": 7.5}, False),
        ({"length": 7.6}, True),
        ({"height": 2.2}, False),
        ({"height": 2.3}, True),
        ({"height": 2.3, "kind": "box"}, False),
    ],
)
def test_a_car_of_the_size_of_a_truck_is_called_one(size, truck):
    assert is_truck(Actor(gap=1.0, **size)) == truck


def test_a_truck_is_named_where_the_camera_draws_one():
    assert (_TALL_M, _LONG_M) == (objects._TALL_M, objects._LONG_M)
    actors = (Actor(gap=20.0, length=10.0),)
    motion = record_motion(Scenario(family="x", ego_speed=10.0, duration=1.0, actors=actors))
    assert motion.names == ["ego", "1: truck"]


def test_motion_without_braking():
    motion = record_motion(PASS)
    assert motion.times[-1] == pytest.approx(2.0)
    assert motion.names == ["ego", "1: car", "2: road marking"]
    # The ego's front is 2.15 m ahead of its centre, and the actor's rear 2.5 m behind its own.
    expected = {
        0: [(0, 0), (2.15 + 20 + 2.5, -3.5)],
        30: [(10, 0), (30.65, -3.5)],
        60: [(20, 0), (35.65, -3.5)],
    }
    for index, positions in expected.items():
        assert motion.positions[index, :2] == pytest.approx(np.array(positions), abs=1e-9)
    assert motion.speeds[[0, 30, 60], 1] == pytest.approx([6.0, 6.0, 4.0])
    assert motion.speeds[:, 0] == pytest.approx(10.0)
    assert motion.sizes[:2].tolist() == [[4.3, 1.8], [5.0, 2.0]]
    assert not motion.contact


def test_motion_ends_at_contact():
    motion = record_motion(make_scenario("CCRs", ego_speed=10.0))
    assert motion.contact
    assert motion.times[-1] == pytest.approx(5.0, abs=1 / 30)
    assert motion.positions[-1, 0, 0] == pytest.approx(50.0)


def test_views_and_speeds(tmp_path):
    motion = record_motion(PASS)
    figure = scenario_figure(tmp_path / "x.png", "a title", motion)
    assert (tmp_path / "x.png").stat().st_size > 5000
    assert figure.get_suptitle() == "a title"
    *views, speeds = figure.axes
    assert [axis.get_ylabel() for axis in views] == ["0.0 s", "0.5 s", "1.0 s", "1.5 s", "2.0 s"]
    for seconds, axis in zip((0.0, 0.5, 1.0, 1.5, 2.0), views, strict=True):
        low, high = axis.get_xlim()
        assert (low, high) == pytest.approx((10 * seconds - 12.0, high))
        ego = axis.patches[3].get_xy()  # after the three lanes
        assert (ego[:, 0].min(), ego[:, 0].max()) == pytest.approx((10 * seconds - 2.15, 10 * seconds + 2.15))
        car = axis.patches[4].get_xy()
        assert (car[:, 1].min(), car[:, 1].max()) == pytest.approx((2.5, 4.5))  # left is up
        assert axis.get_aspect() == 1.0
    # Half of the length and a margin of 4 m ahead of the marking's centre, at 50 + 2.15 + 2.0115 m.
    assert views[0].get_xlim()[1] == pytest.approx(50 + 2.15 + 2.0115 + 2.0115 + 4)
    assert [text.get_text() for text in speeds.get_legend().get_texts()] == motion.names
    lines = {line.get_label(): line.get_ydata() for line in speeds.lines}
    assert lines["ego"][0] == pytest.approx(36.0)
    assert lines["1: car"][-1] == pytest.approx(4 * 3.6)


def test_contact_and_headings_are_drawn(tmp_path):
    turning = Scenario(
        family="x", ego_speed=5.0, duration=np.pi, road=RoadPlan(kind="crossing", distance=20.0),
        ego_path=(Bend(np.pi * 5, 0.1),),
    )  # fmt: skip
    figure = scenario_figure(tmp_path / "turn.png", "turn", record_motion(turning))
    first, second = np.diff(figure.axes[2].patches[-1].get_xy()[:3], axis=0)  # edges, halfway at 45 degrees
    assert first @ second == pytest.approx(0.0, abs=1e-9)
    ego = figure.axes[4].patches[-1].get_xy()
    # A quarter of a circle of 10 m to the left, up to the decision before pi seconds.
    assert ego.mean(axis=0) == pytest.approx([10.0, 10.0], abs=0.6)
    assert np.ptp(ego[:, 1]) == pytest.approx(4.3, abs=0.1)
    figure = scenario_figure(
        tmp_path / "hit.png", "hit", record_motion(make_scenario("CCRs", ego_speed=10.0))
    )
    assert figure.axes[4].get_ylabel() == "5.0 s\ncontact"
    assert figure.axes[5].get_xlabel() == "time [s]   (× contact)"
    empty = scenario_figure(tmp_path / "empty.png", "empty", record_motion(make_scenario("EmptyRoad")))
    assert empty.axes[0].get_xlim() == (-12.0, 20.0)
