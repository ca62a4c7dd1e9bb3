"""False-reaction scenarios of UN R152 Rev.2, Annex 3 Appendix 2: scripted driving without contact."""

from math import pi, sqrt

from lgmd_gym.envs.dynamics.bend import Bend, Pose, arc, lane_change, turn
from lgmd_gym.envs.dynamics.segment import Segment
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.obstacles import rail_along
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    EGO_LENGTH,
    LANE_WIDTH,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_within

OUTER_RADIUS = 25.0  # [m] of the outer side of the road in case 3, the largest allowed
PIPE_PIECE, PIPE_HEIGHT, PIPE_DEPTH = 2.0, 0.8, 0.11  # [m]
PIPE_CLEARANCE, CAR_CLEARANCE = 0.25, 0.1  # [m] between lane edge and pipes, and between pipes and car
APPROACH = 4.0  # [s] at constant speed before the ego or the lead car slows down or steers


@family("TurnBeforeOncoming")
def turn_before_oncoming(left: bool = True, shade: int | None = None) -> Scenario:
    """The ego turns off in front of an oncoming car that has stopped at the junction; not a threat.

    The ego approaches at 30 km/h and turns at 17 km/h; at steering onset the stationary car is within 2.8 s.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 1.

    Args:
        left: Whether the ego turns left, across the front of the other car; otherwise right.
        shade: Grey level of the stationary car in [0, 255]; None to draw it from the seed.
    """
    check_flag("left", left)
    approach, slow, slowing = 30 * KMH, 17 * KMH, 2.5
    slowing_distance = (approach**2 - slow**2) / (2 * slowing)
    onset = APPROACH * approach + slowing_distance + 1.0
    radius = 9.0 if left else 6.0
    bends = turn((1.0 if left else -1.0) * pi / 2, radius, 3.0)
    turn_length = sum(bend.length for bend in bends)
    standing = Actor(gap=onset + 12.5, lateral_offset=LANE_WIDTH, heading=pi, shade=shade)
    reach = radius + 1.5  # extent of the turn along the initial heading
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="TurnBeforeOncoming",
        ego_speed=approach,
        duration=APPROACH + (approach - slow) / slowing + (turn_length + 10.0) / slow,
        actors=(standing,),
        ego_profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), *bends),
        road=RoadPlan(kind="crossing", distance=onset + reach - lane),
    )


@family("LeadTurnsOff")
def lead_turns_off(left: bool = False, shade: int | None = None) -> Scenario:
    """The lead car slows down and turns off while the ego drives straight on; not a threat.

    Both cars start at 40 km/h. The lead car slows to 10 km/h and turns; the ego slows to 27 km/h by then.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 2.

    Args:
        left: Whether the lead car turns left; otherwise right.
        shade: Grey level of the lead car in [0, 255]; None to draw it from the seed.
    """
    check_flag("left", left)
    both, lead_slow, slow, slowing = 40 * KMH, 10 * KMH, 27 * KMH, 3.0
    lead_time = (both - lead_slow) / slowing
    lead_distance = APPROACH * both + (both**2 - lead_slow**2) / (2 * slowing)
    ease = (both - slow) / lead_time  # the ego reaches 27 km/h when the lead car begins to turn
    ego_distance = APPROACH * both + (both**2 - slow**2) / (2 * ease)
    gap_at_turn = 4.6 * (slow - lead_slow)
    radius = 8.0
    lead = Actor(
        gap=gap_at_turn + ego_distance - lead_distance,
        speed=both,
        profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=lead_slow),),
        path=(Bend(lead_distance), *turn((1.0 if left else -1.0) * pi / 2, radius, 2.0)),
        shade=shade,
    )
    onset = EGO_LENGTH / 2 + ego_distance + gap_at_turn + TARGET_LENGTH / 2
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="LeadTurnsOff",
        ego_speed=both,
        duration=APPROACH + lead_time + 6.0,
        actors=(lead,),
        ego_profile=(Segment(start=APPROACH, acceleration=-ease, final_speed=slow),),
        road=RoadPlan(kind="crossing", distance=onset + radius + 1.0 - lane),
    )


@family("CurveObjectOutside")
def curve_with_car_outside(left: bool = True, shade: int | None = None) -> Scenario:
    """The ego drives through a tight curve with guard pipes and a stationary car behind them; not a threat.

    The ego slows from 30 to 22.5 km/h before a curve whose outer side has a radius of 25 m. Guard pipes stand
    along the outer side, and the car just behind them, on the extension of the lane's centre: within 1.6 s at
    the entry of the curve. The pipes are drawn as a closed rail. A right curve is the mirror image, for
    driving on the left; the road drawn is for driving on the right, so the pipes are on its centre line.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 3, with a stationary vehicle.

    Args:
        left: Whether the curve turns left; otherwise right.
        shade: Grey level of the stationary car in [0, 255]; None to draw it from the seed.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    side = 1.0 if check_flag("left", left) else -1.0
    approach, slow, slowing = 30 * KMH, 22.5 * KMH, 2.0
    onset = APPROACH * approach + (approach**2 - slow**2) / (2 * slowing) + 1.0
    radius = OUTER_RADIUS - LANE_WIDTH / 2
    curve, aside = arc(radius, side * pi / 2), LANE_WIDTH / 2 + PIPE_CLEARANCE + PIPE_DEPTH / 2
    path = Path(Pose(0.0, 0.0, 0.0), (Bend(onset), curve))
    pipes = rail_along(
        path, onset - 10.0, onset + curve.length + 10.0, side * aside, PIPE_PIECE, PIPE_HEIGHT, PIPE_DEPTH
    )
    # The car's rear corner on the inside of the curve is the closest to the pipes.
    behind_pipes = radius + aside + PIPE_DEPTH / 2 + CAR_CLEARANCE
    ahead = sqrt(behind_pipes**2 - (radius - TARGET_WIDTH / 2) ** 2)
    standing = Actor(gap=onset - EGO_LENGTH / 2 + ahead, shade=shade)
    return Scenario(
        family="CurveObjectOutside",
        ego_speed=approach,
        duration=APPROACH + (approach - slow) / slowing + (curve.length + 10.0) / slow,
        actors=(standing, *pipes),
        ego_profile=(Segment(start=APPROACH, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), curve),
        road=RoadPlan(kind="curve", distance=onset, bends=(curve,)),
    )


@family("LaneClosure")
def change_lane_before_sign(ego_speed: float = 40 * KMH, left: bool = True) -> Scenario:
    """The ego changes lane before a signboard that closes its lane; not a threat.

    The ego drives at constant speed and begins to steer 4.1 s before the sign.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 4, at 40 km/h.

    Args:
        ego_speed: Ego speed, in [5.56, 16.67] [m/s], which is 20 to 60 km/h.
        left: Whether the ego changes to the left lane; otherwise to the right.
    """
    speed = check_within("ego_speed", ego_speed, 20 * KMH, 60 * KMH, "m/s")
    onset = APPROACH * speed
    shift = lane_change(3.3 * speed, LANE_WIDTH if check_flag("left", left) else -LANE_WIDTH)
    gap = onset + 4.1 * speed
    sign = Actor(gap=gap, kind="box", shade=225, length=0.3, width=1.5, height=1.8)
    return Scenario(
        family="LaneClosure",
        ego_speed=speed,
        duration=APPROACH + 4.1 + 2.0,
        actors=(sign,),
        ego_path=(Bend(onset), *shift),
    )
