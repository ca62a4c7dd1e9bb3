"""Cars, motorcycles and boxes ahead in the ego's lane: CCRs, CCRm, CCRb, CMRs, CMRb, and following."""

from dataclasses import replace
from math import copysign, pi
from typing import Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import (
    EITHER,
    FAST_KMH,
    HEADWAY,
    DrawArguments,
    EgoSpeed,
    Headway,
    LeadShade,
    RiderShade,
    Shade,
    between,
    draw,
    fast,
    grey,
    kmh,
    maybe,
    one,
    slower,
    speed,
    truth,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import MOTORCYCLE
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_HEIGHT,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    Scenario,
    bridge_shadow,
)
from lgmd_gym.errors import check_within, shown

LEAD_IN = (
    3.0  # [s] at constant distance before the lead car brakes; T0 is 1 s before (AEB C2C v4.3.1, 8.2.2.3)
)
RELEASE = 2.5  # [m/s²], deceleration and acceleration of a lead car that brakes and releases

Offset = Annotated[
    float | None,
    maybe("[-20, 20]", "m", "Target centreline minus ego centreline, + left; 0 if no position is given"),
]
Overlap = Annotated[
    float | None,
    maybe("[-1, 1]", "", "Overlapped share of the ego's width; its sign is the side, + left; ±1 is aligned"),
]
ImpactLocation = Annotated[
    float | None,
    maybe(
        "[-0.25, 1.25]",
        "",
        "Position of the target's centre across the ego's width; 0.5 is aligned, larger values are to "
        "the left",
    ),
]
MotorcycleLocation = Annotated[
    float,
    within(
        "[-0.25, 1.25]",
        "",
        "Position of the motorcycle's centre across the ego's width; 0 is the right side and 1 the left",
    ),
]
Gap = Annotated[float | None, maybe("[1, 200]", "m", "Initial distance; 40 m without `gap` and `headway`")]
FreeHeadway = Annotated[float | None, maybe("[0.3, 10]", "s", "Alternative to `gap`: initial time headway")]
BuildUp = Annotated[float, within("[0, 5]", "s", "Time from the onset to the full deceleration")]
Beside = Annotated[
    bool, truth("Whether a second car does the same next to the target, in the lane to the left")
]


def _overlap(rng: np.random.Generator) -> float:
    """Draw 1 (aligned) with probability 0.5, otherwise an overlap of 0.4 to 1 on either side."""
    if EITHER(rng):
        return 1.0
    return between(0.4, 1.0)(rng) * one(1.0, -1.0)(rng)


def _moving(rng: np.random.Generator) -> Arguments:
    ego_speed = kmh(30.0)(rng)
    target_speed = ego_speed * between(0.2, 0.7)(rng)
    return {"ego_speed": ego_speed, "target_speed": target_speed, "overlap": _overlap(rng)}


_STANDING = draw(ego_speed=kmh(), overlap=_overlap)
_BRAKING = draw(
    ego_speed=kmh(30.0),
    headway=between(*HEADWAY),
    deceleration=between(2.0, 6.0),
    build_up=between(0.3, 1.0),
    overlap=_overlap,
)
_HARD_BRAKING = draw(
    ego_speed=kmh(30.0, FAST_KMH[1]),
    headway=between(0.5, 2.0),
    deceleration=between(2.0, 9.0),
    build_up=between(0.2, 1.0),
    overlap=_overlap,
)
_FOLLOWING = draw(ego_speed=kmh(), headway=between(*HEADWAY))
_RELEASING = draw(ego_speed=kmh(40.0), headway=between(1.5, 2.5), speed_drop=between(2.0, 5.0))


@family("CCRs", Level("CCRs", 15.0, _STANDING), Level("FastCCRs", 3.0, fast(_STANDING)), threat=True)
def approach_standing(
    ego_speed: EgoSpeed = 50 * KMH,
    lateral_offset: Offset = None,
    overlap: Overlap = None,
    impact_location: ImpactLocation = None,
    target_heading: Annotated[
        float, within(f"[{-pi / 2}, {pi / 2}]", "rad", "Target heading relative to the ego's, + left")
    ] = 0.0,
    beside: Beside = False,
    shade: Shade = None,
) -> Scenario:
    """The ego approaches a stationary car from behind (Car-to-Car Rear stationary).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2; impact locations: Euro NCAP 2026. At most one of
    `lateral_offset`, `overlap` and `impact_location` can be given.
    """
    target = Actor(
        gap=START_TTC * ego_speed,
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        heading=target_heading,
        shade=shade,
    )
    return _scenario("CCRs", ego_speed, target, beside)


def _closing(rng: np.random.Generator) -> Arguments:
    """Draw a closing speed from 5 km/h to that of a standing target, small ones as often as large ones."""
    ego_speed = kmh(15.0, FAST_KMH[1])(rng)
    closing_speed = ego_speed * (5.0 * KMH / ego_speed) ** between(0.02, 1.0)(rng)
    return {"ego_speed": ego_speed, "target_speed": ego_speed - closing_speed, "overlap": _overlap(rng)}


@family(
    "CCRm",
    Level("CCRm", 13.0, _moving),
    Level("FastCCRm", 2.0, fast(_moving)),
    Level("ClosingLead", 4.0, _closing, twin=True),
    threat=True,
)
def approach_slower(
    ego_speed: EgoSpeed = 50 * KMH,
    target_speed: Annotated[float, slower("Target speed")] = 20 * KMH,
    lateral_offset: Offset = None,
    overlap: Overlap = None,
    impact_location: ImpactLocation = None,
    beside: Beside = False,
    shade: Shade = None,
) -> Scenario:
    """The ego approaches a slower car from behind (Car-to-Car Rear moving).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2, with a target speed of 20 km/h; Euro NCAP Frontal
    Collisions v1.1, 3.1, also with an ego speed of 90 to 130 km/h and a target that is 60 km/h slower.
    """
    if target_speed >= ego_speed:
        raise ValueError(
            f"target_speed must be below ego_speed {ego_speed:g} m/s in CCRm, got {target_speed:g}"
        )
    target = Actor(
        gap=START_TTC * (ego_speed - target_speed),
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        speed=target_speed,
        shade=shade,
    )
    return _scenario("CCRm", ego_speed, target, beside)


@family(
    "CCRb",
    Level("CCRb", 13.0, _BRAKING),
    Level("FastCCRb", 2.0, fast(_BRAKING)),
    Level("HardBrakingLead", 4.0, _HARD_BRAKING, twin=True),
    threat=True,
)
def follow_braking(
    ego_speed: Annotated[float, speed("Initial speed of both cars")] = 50 * KMH,
    gap: Gap = None,
    headway: FreeHeadway = None,
    deceleration: Annotated[float, within("[0.5, 10]", "m/s²", "Full deceleration of the target")] = 6.0,
    build_up: BuildUp = 1.0,
    lateral_offset: Offset = None,
    overlap: Overlap = None,
    impact_location: ImpactLocation = None,
    beside: Beside = False,
    shade: Shade = None,
) -> Scenario:
    """The ego follows a car that brakes to a standstill (Car-to-Car Rear braking).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2.3, at 50 km/h with 2 or 6 m/s² and gaps of 12 or 40 m.
    """
    distance = _gap(ego_speed, gap, headway)
    target = Actor(
        gap=distance,
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        speed=ego_speed,
        profile=(Segment(start=LEAD_IN, acceleration=-deceleration, build_up=build_up),),
        shade=shade,
    )
    # At its scripted speed the ego covers the gap and the lead car's stopping distance.
    contact = LEAD_IN + build_up / 2 + ego_speed / (2 * deceleration) + distance / ego_speed
    return _scenario("CCRb", ego_speed, target, beside, contact)


@family(
    "CMRs",
    Level("CMRs", 4.0, draw(ego_speed=kmh(), impact_location=between(0.1, 0.9))),
    threat=True,
)
def approach_standing_motorcycle(
    ego_speed: EgoSpeed = 50 * KMH, impact_location: MotorcycleLocation = 0.5, shade: RiderShade = None
) -> Scenario:
    """The ego approaches a stationary motorcycle from behind (Car-to-Motorcyclist Rear stationary).

    Source: Euro NCAP Frontal Collisions v1.1.
    """
    made = approach_standing(ego_speed, impact_location=impact_location, shade=shade)
    return _with_motorcycle("CMRs", made)


@family(
    "CMRb",
    Level("CMRb", 4.0, draw(ego_speed=kmh(), impact_location=between(0.1, 0.9), headway=between(*HEADWAY))),
    threat=True,
)
def follow_braking_motorcycle(
    ego_speed: Annotated[float, speed("Initial speed of both")] = 50 * KMH,
    gap: Gap = None,
    headway: FreeHeadway = None,
    deceleration: Annotated[float, within("[0.5, 10]", "m/s²", "Full deceleration of the motorcycle")] = 4.0,
    build_up: BuildUp = 1.0,
    impact_location: MotorcycleLocation = 0.5,
    shade: RiderShade = None,
) -> Scenario:
    """The ego follows a motorcycle that brakes to a standstill (Car-to-Motorcyclist Rear braking).

    Source: Euro NCAP Frontal Collisions v1.1, with a headway of 1.0 s and 4 m/s² within 1.0 s.
    """
    made = follow_braking(
        ego_speed, gap, headway, deceleration, build_up, impact_location=impact_location, shade=shade
    )
    return _with_motorcycle("CMRb", made)


@family("Following", Level("Following", 1.0, _FOLLOWING), Level("FastFollowing", 0.5, fast(_FOLLOWING)))
def follow_steadily(
    ego_speed: Annotated[float, speed("Speed of both cars")] = 50 * KMH,
    headway: Headway = 2.0,
    shade: LeadShade = None,
) -> Scenario:
    """The ego follows a car at a constant distance; not a threat."""
    lead = Actor(gap=ego_speed * headway, speed=ego_speed, shade=shade)
    return Scenario(family="Following", ego_speed=ego_speed, duration=10.0, actors=(lead,))


def _close_release(rng: np.random.Generator) -> Arguments:
    """Draw a short headway, and a brake tap that takes 10 to 60 % of it."""
    ego_speed, headway = kmh(40.0, 100.0)(rng), between(1.0, 2.0)(rng)
    lost = between(0.1, 0.6)(rng) * ego_speed * headway
    return {"ego_speed": ego_speed, "headway": headway, "speed_drop": min((RELEASE * lost) ** 0.5, 6.0)}


@family(
    "BrakeRelease",
    Level("BrakeRelease", 1.0, _RELEASING),
    Level("CloseBrakeRelease", 1.0, _close_release),
    Level("FastBrakeRelease", 0.5, fast(_RELEASING)),
)
def lead_brakes_and_releases(
    ego_speed: Annotated[float, speed("Initial speed of both cars")] = 50 * KMH,
    headway: Headway = 1.5,
    speed_drop: Annotated[
        float, within("[0.1, 40]", "m/s", "Speed that the lead car loses and regains at 2.5 m/s²")
    ] = 5.0,
    shadow_length: Annotated[
        float, within("[0, 100]", "m", "Length of a bridge's shadow along the road; 0 for none")
    ] = 0.0,
    shade: LeadShade = None,
) -> Scenario:
    """The ego follows a car that brakes briefly and regains its speed without contact; not a threat.

    With a bridge's shadow, the lead car begins to brake as it reaches the shadow: brake lights, a shorter
    distance and a dark edge on the road come at the same time.
    """
    gap = ego_speed * headway
    drop = check_within("speed_drop", speed_drop, 0.1, ego_speed, "m/s")
    lost = drop**2 / RELEASE  # half while braking, half while accelerating
    if lost >= gap:
        raise ValueError(
            f"speed_drop {drop:g} m/s reduces the gap of {gap:.1f} m by {lost:.1f} m; "
            "lower it or raise headway"
        )
    braking = Segment(start=LEAD_IN, acceleration=-RELEASE, final_speed=ego_speed - drop)
    accelerating = Segment(start=LEAD_IN, acceleration=RELEASE, final_speed=ego_speed)
    actors = [Actor(gap=gap, speed=ego_speed, profile=(braking, accelerating), shade=shade)]
    if shadow_length > 0.0:
        actors.append(bridge_shadow(gap + LEAD_IN * ego_speed, shadow_length))
    return Scenario(family="BrakeRelease", ego_speed=ego_speed, duration=10.0, actors=tuple(actors))


def _box(widest: float) -> DrawArguments:
    return draw(
        ego_speed=kmh(20.0, 100.0),
        width=between(0.3, widest),
        height=between(0.6, 2.5),
        length=between(0.3, 5.0),
        lateral_offset=between(-0.5, 0.5),
    )


_LOW_BOX = draw(
    ego_speed=kmh(20.0, 100.0),
    width=between(0.3, 2.0),
    height=between(0.2, 1.2),
    length=between(0.2, 2.0),
    lateral_offset=between(-0.5, 0.5),
)
_BESIDE = draw(
    ego_speed=kmh(20.0, 100.0),
    width=between(0.3, 2.0),
    height=between(0.2, 2.5),
    length=between(0.2, 5.0),
    clearance=between(0.5, 2.5),
    left=EITHER,
)


@family(
    "StandingBox",
    Level("StandingBox", 2.0, _box(2.5)),
    Level("NarrowBox", 2.0, _box(1.2)),
    Level("LowBox", 3.0, _LOW_BOX, twin=True),
    Level("BoxPass", 1.0, _BESIDE, threat=False),
    threat=True,
)
def approach_box(
    ego_speed: EgoSpeed = 50 * KMH,
    width: Annotated[float, within("[0.2, 4]", "m", "Width of the box")] = 1.2,
    height: Annotated[float, within("[0.2, 4]", "m", "Height of the box")] = TARGET_HEIGHT,
    length: Annotated[float, within("[0.2, 20]", "m", "Length of the box")] = TARGET_LENGTH,
    lateral_offset: Annotated[
        float,
        within(
            "[-2.85, 2.85]",
            "m",
            "Centre of the box minus the ego's centreline, + left; at most 0.85 + width / 2 to either side, "
            "so that it is in the ego's way",
        ),
    ] = 0.0,
    clearance: Annotated[
        float | None,
        maybe(
            "[0.2, 10]",
            "m",
            "Alternative to `lateral_offset`: distance between the sides of ego and box, which then stands "
            "next to the ego's way and is not a threat",
        ),
    ] = None,
    left: Annotated[bool, truth("Whether a box with a clearance is on the left; otherwise right")] = False,
    shade: Annotated[int | None, grey("the box")] = None,
) -> Scenario:
    """The ego approaches a box that stands in its lane, such as lost cargo or debris.

    It is not a case of a protocol.
    """
    touching = (EGO_WIDTH + width) / 2
    if clearance is not None:
        if lateral_offset != 0.0:
            text = f"lateral_offset={lateral_offset:g} and clearance={clearance:g}"
            raise ValueError(f"{text} both set the lateral position; pass one")
        aside = (touching + clearance) * (1.0 if left else -1.0)
    else:
        if left:
            raise ValueError("left=True requires clearance; pass it, or lateral_offset > 0 without left")
        aside = check_within("lateral_offset", lateral_offset, 0.05 - touching, touching - 0.05, "m")
    box = Actor(
        gap=START_TTC * ego_speed,
        lateral_offset=aside,
        kind="box",
        shade=shade,
        length=length,
        width=width,
        height=height,
    )
    return _scenario("StandingBox", ego_speed, box)


def _scenario(
    name: str, ego_speed: float, target: Actor, beside: bool = False, contact: float = START_TTC
) -> Scenario:
    """Return a scenario with the target and, if `beside`, a copy of it in the lane to the left."""
    second = (replace(target, lateral_offset=LANE_WIDTH, heading=0.0, shade=None),) if beside else ()
    return Scenario(family=name, ego_speed=ego_speed, duration=contact + AFTERMATH, actors=(target, *second))


def _with_motorcycle(name: str, made: Scenario) -> Scenario:
    """Return a rear scenario with a motorcycle in place of the car; the distance to its rear is the same."""
    target = replace(made.actors[0], **MOTORCYCLE.fields)
    return replace(made, family=name, actors=(target,))


def _gap(ego_speed: float, gap: float | None, headway: float | None) -> float:
    """Return the gap [m] from `gap` or `headway`; 40 m if both are None."""
    if headway is None:
        return 40.0 if gap is None else gap
    if gap is not None:
        raise ValueError(f"gap={shown(gap)} and headway={shown(headway)} both set the distance; pass one")
    return ego_speed * headway


def _offset(lateral_offset: float | None, overlap: float | None, impact_location: float | None) -> float:
    """Return the lateral offset [m] from one of the three arguments; 0 if all are None."""
    given = {"lateral_offset": lateral_offset, "overlap": overlap, "impact_location": impact_location}
    given = {name: value for name, value in given.items() if value is not None}
    if len(given) > 1:
        text = " and ".join(f"{name}={shown(value)}" for name, value in given.items())
        raise ValueError(f"{text} both set the lateral position; pass one")
    if overlap is not None:
        # As defined in Euro NCAP AEB C2C v4.3.1, 3.4.
        share = abs(overlap)
        return 0.0 if share == 1.0 else copysign((EGO_WIDTH + TARGET_WIDTH) / 2 - share * EGO_WIDTH, overlap)
    if impact_location is not None:
        # As in the OpenSCENARIO files of Euro NCAP 2026: 0 and 1 are the ego's sides, 0.5 its centreline.
        return (impact_location - 0.5) * EGO_WIDTH
    return 0.0 if lateral_offset is None else lateral_offset
