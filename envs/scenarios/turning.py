"""False-reaction scenarios of UN R152, Annex 3 Appendix 2: the ego's script slows and steers, no contact."""

from math import pi

from lgmd_gym.envs.dynamics.path import Bend, arc, lane_change, turn
from lgmd_gym.envs.dynamics.speed_profile import Segment
from lgmd_gym.envs.dynamics.units import KMH, check_within
from lgmd_gym.envs.scenarios.registry import family
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, LANE_WIDTH, TARGET_LENGTH, Actor, RoadPlan, Scenario

APPROACH = 4.0  # [s] at the approach speed before anything happens


@family("TurnBeforeOncoming")
def turn_before_oncoming(left: bool = True, shade: int | None = None) -> Scenario:
    """Turn off in front of an oncoming car that has stopped at the junction (case 1).

    Approach at 30 km/h, 17 km/h at steer onset with the standing car within 2.8 s, and through the turn.

    Args:
        left: Whether the ego turns left, across the other car's front; else right.
        shade: Body grey of the standing car in [0, 255]; None draws it from the seed.
    """
    approach, slow, slowing = 30 * KMH, 17 * KMH, 2.5
    slow_way = (approach**2 - slow**2) / (2 * slowing)
    onset = APPROACH * approach + slow_way + 1.0
    radius = 9.0 if left else 6.0
    way = turn((1.0 if left else -1.0) * pi / 2, radius, 3.0)
    in_turn = sum(bend.length for bend in way)
    standing = Actor(gap=onset + 12.5, lateral_offset=LANE_WIDTH, heading=pi, shade=shade)
    reach = radius + 1.5  # of clothoid, arc and clothoid, along the old direction
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="TurnBeforeOncoming",
        ego_speed=approach,
        duration=APPROACH + (approach - slow) / slowing + (in_turn + 10.0) / slow,
        actors=(standing,),
        ego_profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), *way),
        road=RoadPlan(kind="crossing", at=onset + reach - lane),
    )


@family("LeadTurnsOff")
def lead_turns_off(left: bool = False, shade: int | None = None) -> Scenario:
    """The car ahead slows down and turns off; the ego goes straight on (case 2).

    Both at 40 km/h, the lead slows to 10 km/h and turns; the ego has slowed to 27 km/h when it does, and
    holds that.

    Args:
        left: Whether the lead turns left; else right.
        shade: Body grey of the lead in [0, 255]; None draws it from the seed.
    """
    both, lead_slow, slow, slowing = 40 * KMH, 10 * KMH, 27 * KMH, 3.0
    lead_time = (both - lead_slow) / slowing
    lead_way = APPROACH * both + (both**2 - lead_slow**2) / (2 * slowing)
    ease = (both - slow) / lead_time  # the ego reaches its slow speed as the lead begins to turn
    ego_way = APPROACH * both + (both**2 - slow**2) / (2 * ease)
    gap_at_turn = 4.6 * (slow - lead_slow)
    radius = 8.0
    lead = Actor(
        gap=gap_at_turn + ego_way - lead_way,
        speed=both,
        profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=lead_slow),),
        path=(Bend(lead_way), *turn((1.0 if left else -1.0) * pi / 2, radius, 2.0)),
        shade=shade,
    )
    onset = EGO_LENGTH / 2 + ego_way + gap_at_turn + TARGET_LENGTH / 2
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="LeadTurnsOff",
        ego_speed=both,
        duration=APPROACH + lead_time + 6.0,
        actors=(lead,),
        ego_profile=(Segment(start=APPROACH, acceleration=-ease, final_speed=slow),),
        road=RoadPlan(kind="crossing", at=onset + radius + 1.0 - lane),
    )


@family("CurveObjectOutside")
def curve_with_car_outside(left: bool = True, shade: int | None = None) -> Scenario:
    """Drive a tight curve; a car stands just outside, where the lane would have gone on (case 3).

    30 km/h, 22.5 km/h at the entry of a 25 m curve with the car within 1.6 s, and through it.

    Args:
        left: Whether the curve turns left; else right.
        shade: Body grey of the standing car in [0, 255]; None draws it from the seed.
    """
    approach, slow, slowing = 30 * KMH, 22.5 * KMH, 2.0
    onset = APPROACH * approach + (approach**2 - slow**2) / (2 * slowing) + 1.0
    curve = arc(25.0, (1.0 if left else -1.0) * pi / 2)
    aside = -1.1 if left else 1.1
    standing = Actor(gap=onset - EGO_LENGTH / 2 + 10.0, lateral_offset=aside, shade=shade)
    return Scenario(
        family="CurveObjectOutside",
        ego_speed=approach,
        duration=APPROACH + (approach - slow) / slowing + (curve.length + 10.0) / slow,
        actors=(standing,),
        ego_profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), curve),
        road=RoadPlan(kind="curve", at=onset, bends=(curve,)),
    )


@family("LaneClosure")
def change_lane_before_sign(ego_speed: float = 40 * KMH, left: bool = True) -> Scenario:
    """Change lane before a signboard that closes the ego's lane (case 4).

    Constant speed; steering begins 4.1 s before the sign.

    Args:
        ego_speed: In [20, 60] km/h, given in m/s; the regulation uses 40 km/h.
        left: Whether to the left; else to the right.
    """
    speed = check_within("ego_speed", ego_speed, 20 * KMH, 60 * KMH, "m/s")
    onset = APPROACH * speed
    shift = lane_change(3.3 * speed, LANE_WIDTH if left else -LANE_WIDTH)
    gap = onset + 4.1 * speed
    sign = Actor(gap=gap, kind="box", shade=225, length=0.3, width=1.5, height=1.8)
    return Scenario(
        family="LaneClosure",
        ego_speed=speed,
        duration=APPROACH + 4.1 + 2.0,
        actors=(sign,),
        ego_path=(Bend(onset), *shift),
    )
