"""What happens, as plain data: a road, the ego's script, and who else is there."""

from dataclasses import dataclass, field

from lgmd_gym.envs.dynamics.path import Bend
from lgmd_gym.envs.dynamics.speed_profile import Segment
from lgmd_gym.envs.dynamics.units import check_finite, check_speed, check_within
from lgmd_gym.errors import unknown_name

EGO_LENGTH, EGO_WIDTH = 4.3, 1.8  # [m]
# The Global Vehicle Target of ISO 19206-3, box of the OpenSCENARIO catalogue for Euro NCAP.
TARGET_LENGTH, TARGET_WIDTH, TARGET_HEIGHT = 4.023, 1.712, 1.427  # [m]
LANE_WIDTH = 3.5  # [m], Euro NCAP AEB C2C v4.3.1, 7.1
ACTOR_KINDS = ("car", "box", "road_marking")
ROAD_KINDS = ("straight", "two-way", "curve", "crossing")


@dataclass(frozen=True, slots=True, kw_only=True)
class Actor:
    """Somebody or something else, placed relative to the ego at the start.

    Attributes:
        gap: Along the ego's heading, from its front bumper to half a length before this one's centre: its
            rear if both look the same way; negative if beside or behind [m].
        lateral_offset: Centre minus the ego's centreline, + left [m].
        heading: Where it looks, against the ego's heading, + left [rad].
        speed: Along its path at the start [m/s].
        profile: Changes of speed, in order of their start.
        path: Bends it drives from its start on; straight for none.
        kind: "car"; "box", solid; or "road_marking", flat, which one drives over.
        shade: Body grey in [0, 255]; None draws it from the environment's seed.
        length: [m].
        width: [m].
        height: [m].
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

    def __post_init__(self) -> None:
        check_within("gap", self.gap, -1000.0, 1000.0, "m")
        check_within("lateral_offset", self.lateral_offset, -500.0, 500.0, "m")
        check_finite("heading", self.heading)
        check_speed("speed", self.speed, zero=True)
        _check_profile(self.profile)
        if self.kind not in ACTOR_KINDS:
            raise unknown_name("actor kind", self.kind, ACTOR_KINDS)
        if self.shade is not None:
            check_within("shade", self.shade, 0, 255)
        for name in ("length", "width", "height"):
            check_within(name, getattr(self, name), 0.0, 1000.0, "m")


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadPlan:
    """The road under the ego.

    Attributes:
        kind: "straight", all lanes one way; "two-way", the ego's lane and one towards it on the left;
            "curve", along `bends`; "crossing", two-way with a road across.
        lanes: Number of lanes of a straight road.
        ego_lane: The ego's lane, 0 the leftmost.
        at: Where the curve begins, or the middle of the road across, ahead of the ego's centre at the
            start [m].
        bends: Arcs of the curve.
    """

    kind: str = "straight"
    lanes: int = 3
    ego_lane: int = 1
    at: float = 0.0
    bends: tuple[Bend, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in ROAD_KINDS:
            raise unknown_name("road kind", self.kind, ROAD_KINDS)
        if not 0 <= self.ego_lane < self.lanes:
            raise ValueError(f"ego_lane must be in [0, {self.lanes - 1}], got {self.ego_lane!r}")

    @property
    def placed(self) -> bool:
        """Whether the road lies relative to where the ego starts."""
        return self.kind in ("curve", "crossing")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One test case, in SI units.

    Attributes:
        family: The scenario family, as in the environment's id ("CCRs").
        ego_speed: The ego's speed at the start [m/s]; 0 only if the profile sets it going.
        duration: The episode is truncated after this time [s].
        actors: Everybody else; the first one is the target that rows speak of.
        ego_profile: The ego's scripted changes of speed.
        ego_path: Bends the ego drives from its start on; straight for none.
        road: The road.
    """

    family: str
    ego_speed: float
    duration: float
    actors: tuple[Actor, ...] = field(default=())
    ego_profile: tuple[Segment, ...] = ()
    ego_path: tuple[Bend, ...] = ()
    road: RoadPlan = field(default_factory=RoadPlan)

    def __post_init__(self) -> None:
        check_speed("ego_speed", self.ego_speed, zero=bool(self.ego_profile))
        _check_profile(self.ego_profile)
        if check_finite("duration", self.duration) <= 0.0:
            raise ValueError(f"duration must be > 0 s, got {self.duration!r}")

    @property
    def top_speed(self) -> float:
        """The highest scripted speed of the ego [m/s]."""
        return max(self.ego_speed, *(phase.final_speed for phase in self.ego_profile), 0.0)


def _check_profile(profile: tuple[Segment, ...]) -> None:
    starts = [phase.start for phase in profile]
    if starts != sorted(starts):
        raise ValueError(f"profile phases must be in order of their start, got starts {starts}")
