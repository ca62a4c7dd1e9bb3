"""Scenarios as plain data: the road, the ego's script, and the other actors."""

from dataclasses import MISSING, replace
from functools import partial
from math import cos, sin

from lgmd_gym.envs.dynamics.script import Bend, Segment, check_profile
from lgmd_gym.envs.dynamics.units import check_speed
from lgmd_gym.errors import check_finite, check_items, check_known, check_type, check_whole, shown
from lgmd_gym.fields import Field, Record, number, optional, record, text, value, whole

EGO_LENGTH, EGO_WIDTH = 4.3, 1.8  # [m]
WHEELBASE = 2.67  # [m]
REAR_AXLE = WHEELBASE / 2  # [m], distance of the ego's centre ahead of its rear axle
# Global Vehicle Target of ISO 19206-3, bounding box of Euro NCAP's OpenSCENARIO catalogue.
TARGET_LENGTH, TARGET_WIDTH, TARGET_HEIGHT = 4.023, 1.712, 1.427  # [m]
TARGET_TRACK, TYRE_WIDTH = 1.434, 0.205  # [m]; the track is of that catalogue, the tyre of a common size
# Length, width and height of the targets of ISO 19206-2 (adult, child), -4 and -5 [m]; the height of a
# two-wheeler includes its rider.
ADULT_SIZE = (0.6, 0.5, 1.8)
CHILD_SIZE = (0.711, 0.298, 1.154)
BICYCLE_SIZE = (1.89, 0.5, 1.86)
MOTORCYCLE_SIZE = (2.08, 0.79, 1.45)
LANE_WIDTH = 3.5  # [m], Euro NCAP AEB C2C v4.3.1, 7.1
ACTOR_KINDS = ("car", "box", "road_marking", "pedestrian", "bicycle", "motorcycle")
ROAD_KINDS = ("straight", "two-way", "curve", "crossing")
MAX_LANES = 100
BRIDGE_SHADOW = 30  # grey level
START_TTC = 5.0
"""Time from the start to the first possible contact at the scripted speeds [s]: 1 s more than the protocols'
T0 of 4 s, so that braking from the start counts as premature."""
AFTERMATH = 6.0
"""Maximum duration of an episode after the scripted contact [s], enough for a slow stop."""


def _items(kind: type, doc: str) -> Field:
    """Declare a tuple of instances of a class, by default empty."""
    return value((), lambda name, given: check_items(name, given, kind), doc)


def _kind(default: str, label: str, names: tuple[str, ...], doc: str) -> Field:
    """Declare one of some names, whose messages begin with a label."""
    return value(default, lambda _, given: check_known(label, given, names), doc, ", ".join(map(repr, names)))


@record
class Actor(Record):
    """Another road user or object, placed relative to the ego at the start."""

    gap: float = number(
        MISSING,
        "[-1000, 1000]",
        "m",
        "Distance along the ego's heading from its front bumper to the point half a length before the "
        "actor's centre, which is the actor's rear if it has the ego's heading; negative for actors next to "
        "or behind the ego.",
    )
    lateral_offset: float = number(0.0, "[-500, 500]", "m", "Actor centre minus ego centreline, + left.")
    heading: float = value(0.0, check_finite, "Heading relative to the ego's, + left.", unit="rad")
    speed: float = value(
        0.0, partial(check_speed, zero=True), "Initial speed along its path, in [0, 40].", unit="m/s"
    )
    profile: tuple[Segment, ...] = _items(Segment, "Scripted changes of speed, in order of their start.")
    path: tuple[Bend, ...] = _items(Bend, "Bends driven from the start on; empty for a straight path.")
    kind: str = _kind(
        "car",
        "actor kind",
        ACTOR_KINDS,
        "Pedestrian; bicycle or motorcycle, with a rider; car; box, a solid object; or road marking, a flat "
        "object that the ego drives over.",
    )
    shade: int | None = optional(
        whole(None, "[0, 255]", doc="Grey level; None to draw it from the environment's seed.")
    )
    length: float = number(TARGET_LENGTH, "[0, 1000]", "m", "Length.")
    width: float = number(TARGET_WIDTH, "[0, 1000]", "m", "Width.")
    height: float = number(TARGET_HEIGHT, "[0, 1000]", "m", "Height.")
    reference: float = number(
        0.0,
        "[-20, 20]",
        "m",
        "Distance of the centre ahead of the point that follows the path, such as the rear axle.",
    )

    def check(self) -> None:
        """Raise ValueError if a segment of the profile does not lead to its final speed."""
        check_profile(self.speed, self.profile)


def bridge_shadow(gap: float, length: float, shade: int = BRIDGE_SHADOW) -> Actor:
    """Return the shadow of a bridge across the road.

    Args:
        gap: Distance from the ego's front bumper to the shadow [m].
        length: Length along the road [m].
        shade: Grey level in [0, 255].
    """
    return Actor(gap=gap, kind="road_marking", shade=shade, length=length, width=40.0, height=0.0)


@record
class RoadPlan(Record):
    """Layout of the road.

    A "straight" road has parallel lanes in one direction, a "two-way" road the ego's lane and an oncoming
    lane on its left. A "curve" is a two-way road along `bends`, a "crossing" a two-way road crossed by
    another one.
    """

    kind: str = _kind("straight", "road kind", ROAD_KINDS, "Kind of road.")
    lanes: int = whole(3, f"[1, {MAX_LANES}]", doc="Number of lanes of a straight road.")
    ego_lane: int = whole(1, "[0, 99]", doc="Lane of the ego on a straight road, 0 the leftmost.")
    distance: float = number(
        0.0,
        "[-10000, 10000]",
        "m",
        "Distance from the ego's initial centre to the start of the curve or to the centre of the crossing "
        "road.",
    )
    bends: tuple[Bend, ...] = _items(Bend, "Arcs of the curve.")

    def check(self) -> None:
        """Raise ValueError if the road does not have the ego's lane."""
        check_whole("ego_lane", self.ego_lane, 0, self.lanes - 1)

    @property
    def relative_to_ego(self) -> bool:
        """Whether the road is placed relative to the ego's initial position."""
        return self.kind in ("curve", "crossing")


def _duration(name: str, given: object) -> float:
    duration = check_finite(name, given)
    if duration <= 0.0:
        raise ValueError(f"{name} must be > 0 s, got {shown(given)}")
    return duration


@record
class Scenario(Record):
    """One test case in SI units."""

    family: str = text(MISSING, 'Scenario family, as in the environment id ("CCRs").')
    ego_speed: float = value(
        MISSING,
        partial(check_speed, zero=True),
        "Initial ego speed, in (0, 40]; 0 is allowed with an `ego_profile`.",
        unit="m/s",
    )
    duration: float = value(
        MISSING, _duration, "Time after which the episode is truncated, above 0.", unit="s"
    )
    actors: tuple[Actor, ...] = _items(
        Actor, "Other road users and objects; benchmark rows refer to the first one as the target."
    )
    ego_profile: tuple[Segment, ...] = _items(
        Segment, "Scripted changes of the ego's speed, in order of their start."
    )
    ego_path: tuple[Bend, ...] = _items(
        Bend, "Bends that the ego drives from the start on; empty for a straight path."
    )
    road: RoadPlan = value(
        RoadPlan(), lambda name, given: check_type(name, given, RoadPlan), "Layout of the road."
    )
    ego_length: float = number(EGO_LENGTH, "[1, 20]", "m", "Length of the ego.")
    ego_width: float = number(EGO_WIDTH, "[0.5, 4]", "m", "Width of the ego.")
    ego_reference: float = number(
        0.0,
        "[-20, 20]",
        "m",
        "Distance of the ego's centre ahead of the point that follows `ego_path`, see `REAR_AXLE`.",
    )

    def check(self) -> None:
        """Raise ValueError if the ego has neither speed nor profile, or its profile contradicts itself."""
        check_speed("ego_speed", self.ego_speed, zero=bool(self.ego_profile))
        check_profile(self.ego_speed, self.ego_profile)

    @property
    def top_speed(self) -> float:
        """Highest scripted speed of the ego [m/s]."""
        return max(self.ego_speed, *(segment.final_speed for segment in self.ego_profile), 0.0)


def without_target(scenario: Scenario) -> Scenario:
    """Return a scenario without its first actor, the target, so that a threat becomes a non-threat."""
    return replace(scenario, actors=scenario.actors[1:])


def free_lane(scenario: Scenario) -> int | None:
    """Return the index of a lane next to the ego's that no actor uses; None without one.

    The right lane comes first. Only straight roads with lanes in one direction are considered, and only
    scenarios in which the ego and the other solid actors drive straight on.
    """
    road, solid = scenario.road, [actor for actor in scenario.actors if actor.kind != "road_marking"]
    if road.kind != "straight" or scenario.ego_path or any(map(_leaves_lane, solid)):
        return None
    for lane in (road.ego_lane + 1, road.ego_lane - 1):
        offset = (road.ego_lane - lane) * LANE_WIDTH
        if 0 <= lane < road.lanes and not any(_reaches(actor, offset) for actor in solid):
            return lane
    return None


def _leaves_lane(actor: Actor) -> bool:
    return bool(actor.path) or (actor.speed > 0.0 and abs(sin(actor.heading)) > 1e-9)


def _reaches(actor: Actor, offset: float) -> bool:
    """Return whether an actor reaches into the lane with a lateral offset from the ego's [m]."""
    half = 0.5 * (actor.width * abs(cos(actor.heading)) + actor.length * abs(sin(actor.heading)))
    return abs(actor.lateral_offset - offset) < 0.5 * LANE_WIDTH + half
