"""Road plans as OpenDRIVE 1.7: x along the ego's heading from its initial centre, y to the left."""

from math import pi
from xml.etree import ElementTree as ET

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Bend, Pose
from lgmd_gym.envs.families.scenario import LANE_WIDTH, RoadPlan

BEHIND, AHEAD, ARM = 300.0, 6000.0, 250.0  # [m], extent of straight roads, and of crossing roads
HEADER = {"revMajor": "1", "revMinor": "7", "name": "lgmd-gym", "version": "1.00"}


def road_xml(plan: RoadPlan) -> ET.Element:
    """Return a road plan as OpenDRIVE.

    A crossing is written as two roads that overlap, without a junction.
    """
    root = ET.Element("OpenDRIVE")
    ET.SubElement(root, "header", HEADER)
    if plan.kind == "curve":
        _road(root, 0, (-BEHIND, LANE_WIDTH / 2, 0.0), _curve(plan), 1, 1)
        return root
    straight = [Bend(BEHIND + AHEAD)]
    if plan.kind == "straight":
        left = (plan.ego_lane + 0.5) * LANE_WIDTH
        _road(root, 0, (-BEHIND, left, 0.0), straight, 0, plan.lanes)
        return root
    _road(root, 0, (-BEHIND, LANE_WIDTH / 2, 0.0), straight, 1, 1)
    if plan.kind == "crossing":
        start = (plan.distance, LANE_WIDTH / 2 - ARM, pi / 2)
        _road(root, 1, start, [Bend(2.0 * ARM)], 1, 1)
    return root


def _curve(plan: RoadPlan) -> list[Bend]:
    """Return the bends of the reference line, half a lane to the left of the plan's bends."""
    bends = [Bend(BEHIND + plan.distance)]
    for bend in plan.bends:
        scale = 1.0 - bend.curvature * LANE_WIDTH / 2
        bends.append(Bend(bend.length * scale, bend.curvature / scale))
    return [*bends, Bend(ARM)]


def _road(
    root: ET.Element, number: int, start: tuple[float, float, float], bends: list[Bend], left: int, right: int
) -> None:
    """Append a road with driving lanes to the left and right of its reference line."""
    length = sum(bend.length for bend in bends)
    values = {"id": str(number), "junction": "-1", "length": repr(length), "name": f"road {number}"}
    road = ET.SubElement(root, "road", values)
    view = ET.SubElement(road, "planView")
    path, s = Path(Pose(start[0], -start[1], -start[2]), tuple(bends)), 0.0
    for bend in bends:
        pose = path.pose(s)
        place = {"s": s, "x": pose.x, "y": -pose.y, "hdg": -pose.heading, "length": bend.length}
        item = ET.SubElement(view, "geometry", {name: repr(float(value)) for name, value in place.items()})
        if bend.curvature == 0.0:
            ET.SubElement(item, "line")
        else:
            ET.SubElement(item, "arc", {"curvature": repr(bend.curvature)})
        s += bend.length
    section = ET.SubElement(ET.SubElement(road, "lanes"), "laneSection", {"s": "0"})
    if left:
        _lanes(section, "left", range(left, 0, -1))
    centre = ET.SubElement(ET.SubElement(section, "center"), "lane", {"id": "0", "type": "none"})
    _mark(centre, "broken" if left else "solid")
    _lanes(section, "right", range(-1, -right - 1, -1))


def _lanes(section: ET.Element, side: str, numbers: range) -> None:
    group = ET.SubElement(section, side)
    outer = max(numbers, key=abs)
    for number in numbers:
        lane = ET.SubElement(group, "lane", {"id": str(number), "type": "driving"})
        ET.SubElement(lane, "width", {"sOffset": "0", "a": repr(LANE_WIDTH), "b": "0", "c": "0", "d": "0"})
        _mark(lane, "solid" if number == outer else "broken")


def _mark(lane: ET.Element, kind: str) -> None:
    ET.SubElement(lane, "roadMark", {"sOffset": "0", "type": kind, "color": "standard"})
