"""What happens, as plain data: a straight road, the ego's script, and who else is there."""

from dataclasses import dataclass, field

from lgmd_gym.envs.units import check_finite, check_speed, check_within

EGO_LENGTH, EGO_WIDTH = 4.3, 1.8  # [m]
# The Global Vehicle Target of ISO 19206-3, box of the OpenSCENARIO catalogue for Euro NCAP.
TARGET_LENGTH, TARGET_WIDTH, TARGET_HEIGHT = 4.023, 1.712, 1.427  # [m]
LANE_WIDTH = 3.5  # [m], Euro NCAP AEB C2C v4.3.1, 7.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """From `start` on, accelerate until `final_speed` is reached.

    Attributes:
        start: Time of the onset [s].
        acceleration: Acceleration once built up, negative for braking [m/s²].
        build_up: Time from the onset to the full acceleration, a linear ramp [s].
        final_speed: Speed at which the phase ends [m/s].
    """

    start: float
    acceleration: float
    build_up: float = 0.0
    final_speed: float = 0.0

    def __post_init__(self) -> None:
        check_within("start", self.start, 0.0, 1e4, "s")
        check_within("acceleration", self.acceleration, -12.0, 12.0, "m/s²")
        check_within("build_up", self.build_up, 0.0, 10.0, "s")
        check_speed("final_speed", self.final_speed, zero=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Actor:
    """Another road user, placed relative to the ego at the start.

    Attributes:
        gap: The ego's front bumper to this one's rear, along the road; negative if beside or behind [m].
        lateral_offset: Centreline minus the ego's, + left [m].
        speed: Speed along its heading at the start [m/s].
        profile: Changes of speed, in order of their start.
        shade: Body grey in [0, 255]; None draws it from the environment's seed.
        length: [m].
        width: [m].
        height: [m].
    """

    gap: float
    lateral_offset: float = 0.0
    speed: float = 0.0
    profile: tuple[Phase, ...] = ()
    shade: int | None = None
    length: float = TARGET_LENGTH
    width: float = TARGET_WIDTH
    height: float = TARGET_HEIGHT

    def __post_init__(self) -> None:
        check_within("gap", self.gap, -1000.0, 1000.0, "m")
        check_within("lateral_offset", self.lateral_offset, -20.0, 20.0, "m")
        check_speed("speed", self.speed, zero=True)
        if self.shade is not None:
            check_within("shade", self.shade, 0, 255)
        starts = [phase.start for phase in self.profile]
        if starts != sorted(starts):
            raise ValueError(f"profile phases must be in order of their start, got starts {starts}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One test case on a straight road, in SI units.

    Attributes:
        family: The scenario family, as in the environment's id ("CCRs").
        ego_speed: The ego's scripted speed, also its speed at the start [m/s].
        duration: The episode is truncated after this time [s].
        actors: Everybody else; the first one is the target that rows speak of.
        lanes: Number of lanes.
        ego_lane: The ego's lane, 0 the leftmost.
    """

    family: str
    ego_speed: float
    duration: float
    actors: tuple[Actor, ...] = field(default=())
    lanes: int = 3
    ego_lane: int = 1

    def __post_init__(self) -> None:
        check_speed("ego_speed", self.ego_speed)
        if check_finite("duration", self.duration) <= 0.0:
            raise ValueError(f"duration must be > 0 s, got {self.duration!r}")
        if not 0 <= self.ego_lane < self.lanes:
            raise ValueError(f"ego_lane must be in [0, {self.lanes - 1}], got {self.ego_lane!r}")
