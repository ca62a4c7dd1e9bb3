"""Scenarios as plain data: the road, the ego's script, and the other actors."""

from dataclasses import dataclass, field, replace

from lgmd_gym.envs.dynamics.bend import Bend
from lgmd_gym.envs.dynamics.segment import Segment, check_profile
from lgmd_gym.envs.dynamics.units import check_speed
from lgmd_gym.errors import (
    check_finite,
    check_items,
    check_known,
    check_text,
    check_type,
    check_whole,
    check_within,
    shown,
)

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Actor:
    """Another road user or object, placed relative to the ego at the start.

    Attributes:
        gap: Distance along the ego's heading from its front bumper to the point half a length before the
            actor's centre, which is the actor's rear if it has the ego's heading; negative for actors next
            to or behind the ego [m].
        lateral_offset: Actor centre minus ego centreline, + left [m].
        heading: Heading relative to the ego's, + left [rad].
        speed: Initial speed along its path, in [0, 40] [m/s].
        profile: Scripted changes of speed, in order of their start.
        path: Bends driven from the start on; empty for a straight path.
        kind: "car"; "pedestrian"; "bicycle" or "motorcycle", with a rider; "box", a solid object; or
            "road_marking", a flat object that the ego drives over.
        shade: Grey level in [0, 255]; None to draw it from the environment's seed.
        length: Length [m].
        width: Width [m].
        height: Height [m].
        reference: Distance of the centre ahead of the point that follows the path, such as the rear axle, in
            [-20, 20] [m].
    """

    gap: float
    lateral_offset: float = 0.0
    heading: float = 0.0
    speed: float = 0.0
    profile: tuple[Segment, ...] = ()
    path: tuple[Bend, ...] = ()
    kind: str = "car"
    shade: int | None = None
    length: float = TARGET_LENGTH
    width: float = TARGET_WIDTH
    height: float = TARGET_HEIGHT
    reference: float = 0.0

    def __post_init__(self) -> None:
        # As float, because small integers of numpy overflow in calculations.
        gap = check_within("gap", self.gap, -1000.0, 1000.0, "m")
        lateral_offset = check_within("lateral_offset", self.lateral_offset, -500.0, 500.0, "m")
        heading = check_finite("heading", self.heading)
        object.__setattr__(self, "gap", gap)
        object.__setattr__(self, "lateral_offset", lateral_offset)
        object.__setattr__(self, "heading", heading)
        check_speed("speed", self.speed, zero=True)
        object.__setattr__(self, "profile", check_items("profile", self.profile, Segment))
        object.__setattr__(self, "path", check_items("path", self.path, Bend))
        check_profile(self.speed, self.profile)
        check_known("actor kind", self.kind, ACTOR_KINDS)
        if self.shade is not None:
            check_whole("shade", self.shade, 0, 255)
        for name in ("length", "width", "height"):
            check_within(name, getattr(self, name), 0.0, 1000.0, "m")
        check_within("reference", self.reference, -20.0, 20.0, "m")


def bridge_shadow(gap: float, length: float, shade: int = BRIDGE_SHADOW) -> Actor:
    """Return the shadow of a bridge across the road.

    Args:
        gap: Distance from the ego's front bumper to the shadow [m].
        length: Length along the road [m].
        shade: Grey level in [0, 255].
    """
    return Actor(gap=gap, kind="road_marking", shade=shade, length=length, width=40.0, height=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadPlan:
    """Layout of the road.

    Attributes:
        kind: "straight", parallel lanes in one direction; "two-way", the ego's lane and an oncoming lane on
            its left; "curve", a two-way road along `bends`; "crossing", a two-way road crossed by another.
        lanes: Number of lanes of a straight road.
        ego_lane: Lane of the ego on a straight road, 0 the leftmost.
        distance: Distance from the ego's initial centre to the start of the curve or to the centre of the
            crossing road [m].
        bends: Arcs of the curve.
    """

    kind: str = "straight"
    lanes: int = 3
    ego_lane: int = 1
    distance: float = 0.0
    bends: tuple[Bend, ...] = ()

    def __post_init__(self) -> None:
        check_known("road kind", self.kind, ROAD_KINDS)
        check_whole("lanes", self.lanes, 1, MAX_LANES)
        check_whole("ego_lane", self.ego_lane, 0, self.lanes - 1)
        check_within("distance", self.distance, -1e4, 1e4, "m")
        object.__setattr__(self, "bends", check_items("bends", self.bends, Bend))

    @property
    def relative_to_ego(self) -> bool:
        """Whether the road is placed relative to the ego's initial position."""
        return self.kind in ("curve", "crossing")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One test case in SI units.

    Attributes:
        family: Scenario family, as in the environment id ("CCRs").
        ego_speed: Initial ego speed, in (0, 40] [m/s]; 0 is allowed with an `ego_profile`.
        duration: Time after which the episode is truncated [s].
        actors: Other road users and objects; benchmark rows refer to the first one as the target.
        ego_profile: Scripted changes of the ego's speed, in order of their start.
        ego_path: Bends that the ego drives from the start on; empty for a straight path.
        road: Layout of the road.
        ego_length: Length of the ego, in [1, 20] [m].
        ego_width: Width of the ego, in [0.5, 4] [m].
        ego_reference: Distance of the ego's centre ahead of the point that follows `ego_path`, in [-20, 20]
            [m]; see `REAR_AXLE`.
    """

    family: str
    ego_speed: float
    duration: float
    actors: tuple[Actor, ...] = field(default=())
    ego_profile: tuple[Segment, ...] = ()
    ego_path: tuple[Bend, ...] = ()
    road: RoadPlan = field(default_factory=RoadPlan)
    ego_length: float = EGO_LENGTH
    ego_width: float = EGO_WIDTH
    ego_reference: float = 0.0

    def __post_init__(self) -> None:
        check_text("family", self.family)
        object.__setattr__(self, "actors", check_items("actors", self.actors, Actor))
        object.__setattr__(self, "ego_profile", check_items("ego_profile", self.ego_profile, Segment))
        object.__setattr__(self, "ego_path", check_items("ego_path", self.ego_path, Bend))
        check_type("road", self.road, RoadPlan)
        check_speed("ego_speed", self.ego_speed, zero=bool(self.ego_profile))
        check_profile(self.ego_speed, self.ego_profile)
        check_within("ego_length", self.ego_length, 1.0, 20.0, "m")
        check_within("ego_width", self.ego_width, 0.5, 4.0, "m")
        check_within("ego_reference", self.ego_reference, -20.0, 20.0, "m")
        if check_finite("duration", self.duration) <= 0.0:
            raise ValueError(f"duration must be > 0 s, got {shown(self.duration)}")

    @property
    def top_speed(self) -> float:
        """Highest scripted speed of the ego [m/s]."""
        return max(self.ego_speed, *(segment.final_speed for segment in self.ego_profile), 0.0)


def without_target(scenario: Scenario) -> Scenario:
    """Return a scenario without its first actor, the target, so that a threat becomes a non-threat."""
    return replace(scenario, actors=scenario.actors[1:])
