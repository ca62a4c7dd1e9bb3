"""Trailers: bodies that follow the hitch of the vehicle that pulls them, without slip of their axle."""

from math import cos, sin
from typing import NamedTuple

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.bodies import Trailer
from lgmd_gym.openscenario.motion import Timeline, Track
from lgmd_gym.openscenario.world import Mover, ScenarioMap

STEP = 0.5
"""Length of the bends of a trailer's path [m]."""
_SAMPLE = 2.0  # [m]
_STRAIGHT = 1e-6  # [rad] between vehicle and trailer, below which the path ends with a straight
_SETTLING = 20.0  # coupler lengths after the last bend within which a trailer is behind its vehicle again
_LONGEST = 5000.0  # [m] of a path
_EXACT, _LIMIT = 0.1, 0.5  # [m] of deviation above which there is a note, and an error


class Followed(NamedTuple):
    """Path of a trailer."""

    track: Track  # path of its axle
    share: float  # distance along it per distance of the vehicle, on average; 1 where that is exact
    apart: tuple[
        float, ...
    ]  # distance of its coupler from the hitch after every `_SAMPLE` of the vehicle [m]

    def deviation(self, distance: float) -> float:
        """Return the largest distance of its coupler from the hitch until a distance of the vehicle [m]."""
        covered = len(self.apart) * _SAMPLE
        straight_on = max(distance - covered, 0.0) * (1.0 - self.share)
        return max(self.apart[: int(distance / _SAMPLE) + 1], default=0.0) + straight_on


class Pulled(NamedTuple):
    """A trailer in motion."""

    mover: Mover
    trailer: Trailer
    followed: tuple[Followed, ...]  # its path, and those of the trailers before it

    def check(self, time: float, world: ScenarioMap) -> None:
        """Note how far it leaves its hitch until a time [s]; ValueError above 0.5 m."""
        distance = self.mover.timeline.at(time).distance
        deviation = sum(item.deviation(distance) for item in self.followed)
        if deviation > _LIMIT:
            raise self.trailer.item.error(
                f"the bends are too tight for trailer {self.trailer.name!r}, which would leave its hitch by "
                f"{deviation:.2g} m; remove it"
            )
        if deviation > _EXACT:
            text = f"trailer {self.trailer.name!r} leaves its hitch by up to {deviation:.2g} m"
            world.note(self.trailer.item, text)


def follow_hitch(path: Track, trailer: Trailer) -> Followed:
    """Return the path of a trailer that stands straight behind its vehicle at the start.

    With the headings θ of the vehicle and ψ of the trailer, φ = θ - ψ and the curvature κ of the vehicle, an
    axle without slip turns by dψ/ds = (sin φ + hitch κ cos φ) / coupler, and moves by cos φ - hitch κ sin φ,
    per distance of the vehicle. The speed of the trailer is a constant share of that of the vehicle.

    Args:
        path: Path of the reference point of the vehicle.
        trailer: Places of the hitch and the coupler.
    """
    hitch, coupler = trailer.hitch, trailer.coupler

    def turn(angle: float, curvature: float) -> float:
        return (sin(angle) + hitch * curvature * cos(angle)) / coupler

    turns, bent, angle = list[float](), 0.0, 0.0
    end = min(path.length, _LONGEST)
    while len(turns) * STEP < end or (
        abs(angle) > _STRAIGHT and len(turns) * STEP < end + _SETTLING * coupler
    ):
        curvature = path.curvature((len(turns) + 0.5) * STEP)
        half = angle + STEP / 2 * (curvature - turn(angle, curvature))
        turns.append(turn(half, curvature))
        if len(turns) * STEP <= end:
            bent += (cos(half) - hitch * curvature * sin(half)) * STEP
        angle += STEP * (curvature - turns[-1])
    whole = int(end / STEP) * STEP
    share = bent / whole if abs(whole - bent) > _EXACT else 1.0
    bends = tuple(Bend(STEP * share, item / share) for item in turns) if any(turns) else ()
    track = Track(path.start.moved(hitch - coupler), bends)
    places = [number * _SAMPLE for number in range(1, int(len(turns) * STEP / _SAMPLE) + 1)] if bends else []
    apart = [path.at(place).moved(hitch).distance(track.at(place * share).moved(coupler)) for place in places]
    return Followed(track, share, tuple(apart))


def pulled_by(mover: Mover) -> list[Pulled]:
    """Return the trailers of an entity in motion; ValueError for a vehicle that drives backwards."""
    found: list[Pulled] = []
    for trailer in mover.trailers:
        if mover.backwards:
            raise trailer.item.error(f"{mover.name!r} drives backwards with a trailer; remove the trailer")
        before, paths = (found[-1].mover, found[-1].followed) if found else (mover, ())
        followed = follow_hitch(before.path, trailer)
        body = Mover(trailer.name, trailer.body, track=followed.track, start=followed.track.start)
        body.timeline = Timeline(before.timeline.initial_speed * followed.share)
        body.timeline.copy_from(0.0, before.timeline, (followed.share, 0.0))
        body.turns = mover.turns
        found.append(Pulled(body, trailer, (*paths, followed)))
    return found
