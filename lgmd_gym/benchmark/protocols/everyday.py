"""Everyday threats that the protocols do not have, and their neighbours without a threat; own cases."""

from collections.abc import Iterator

from lgmd_gym.benchmark.case import Case, Row, Suite, to_mps
from lgmd_gym.envs.dynamics.units import KMH

THREATS, NEIGHBOURS = "everyday-threats", "everyday-neighbours"
SIDES = ("left", "right")


def _case(suite: str, kind: str, environment: str, variant: str, **arguments: object) -> Case:
    """Return a case whose family is the name of its random levels, such as "LowBox" of StandingBox."""
    return Case(suite, kind, variant, tuple(arguments.items()), environment)


def _threat(kind: str, environment: str, kmh: int, tail: str, **arguments: object) -> Case:
    return _case(THREATS, kind, environment, f"v{kmh}/{tail}", ego_speed=to_mps(kmh), **arguments)


def _neighbour(kind: str, environment: str, kmh: int, tail: str, **arguments: object) -> Case:
    return _case(NEIGHBOURS, kind, environment, f"v{kmh}/{tail}", ego_speed=to_mps(kmh), **arguments)


def _cut_ins() -> Iterator[Case]:
    """Yield 20 cut-ins, from both sides in turn: 5 to 40 km/h slower, 0.8 to 3 s, in a lane change of 3 s."""
    grid = [(speed, slower, ttc) for speed in (50, 80, 120) for slower in (5, 20, 40) for ttc in (1.0, 2.0)]
    for number, (speed, slower, ttc) in enumerate((*grid, (80, 40, 0.8), (80, 40, 3.0))):
        side = SIDES[number % 2]
        yield _threat(
            "CutInThreat",
            "CutIn",
            speed,
            f"slower{slower}-ttc{ttc:g}-{side}",
            excess=-to_mps(slower),
            end_ttc=ttc,
            change_length=round(max(3.0 * (speed - slower) * KMH, 10.0), 3),
            left=side == "left",
        )


def _leads() -> Iterator[Case]:
    """Yield 18 slower leads, from 5 km/h of closing speed on, and 20 that brake within 0.3 s."""
    small = [(speed, closing) for speed in (30, 50, 80, 110, 130) for closing in (5, 10, 20)]
    for speed, closing in (*small, (80, 40), (110, 60), (130, 90)):
        yield _threat("ClosingLead", "CCRm", speed, f"closing{closing}", target_speed=to_mps(speed - closing))
    grid = [
        (speed, strength, headway)
        for speed in (50, 80, 120)
        for strength in (2, 5, 8)
        for headway in (0.8, 1.5)
    ]
    for speed, strength, headway in (*grid, (80, 9, 0.5), (80, 9, 2.0)):
        yield _threat(
            "HardBrakingLead",
            "CCRb",
            speed,
            f"brake{strength}-headway{headway:g}",
            deceleration=float(strength),
            headway=headway,
            build_up=0.3,
        )


def _towards() -> Iterator[Case]:
    """Yield 14 targets that move towards the ego: six cars, four pedestrians and four bicycles."""
    for speed in (30, 50):
        for rolling in (0.5, 2.0, 5.0):
            yield _threat(
                "RollingCar", "CCFhos", speed, f"rolling{rolling:g}", target_speed=rolling, yields=True
            )
    for speed in (30, 50):
        for walking in (1.5, 4.0):
            yield _threat(
                "PedestrianTowards", "CPLA", speed, f"walking{walking:g}", walking_speed=walking, towards=True
            )
    for speed in (30, 50):
        for riding in (2.0, 5.0):
            yield _threat(
                "BicycleTowards", "CBLA", speed, f"riding{riding:g}", bicycle_speed=riding, towards=True
            )


def _persons() -> Iterator[Case]:
    """Yield 12 persons who stand or lie, at 30, 50 and 70 km/h, on either side of the ego's centreline."""
    kinds: tuple[tuple[str, str, dict[str, bool]], ...] = (
        ("StandingPerson", "adult", {}),
        ("StandingChild", "child", {"child": True}),
        ("LyingPerson", "adult", {"lying": True}),
        ("LyingPerson", "child", {"lying": True, "child": True}),
    )
    for kind, tail, arguments in kinds:
        for speed, location in ((30, 0.5), (50, 0.3), (70, 0.7)):
            yield _threat(kind, "CPLA", speed, tail, walking_speed=0.0, impact_location=location, **arguments)


def _boxes() -> Iterator[Case]:
    """Yield 10 boxes 0.2 to 1.2 m high; those up to 0.3 m are 0.6 m wide, the others 1 m."""
    for speed in (50, 80):
        for height in (0.2, 0.3, 0.5, 0.8, 1.2):
            width = 0.6 if height <= 0.3 else 1.0
            yield _threat(
                "LowBox", "StandingBox", speed, f"height{height:g}", height=height, width=width, length=0.6
            )


def _animals() -> Iterator[Case]:
    """Yield eight animals that cross, from both sides in turn."""
    number = 0
    for animal, running in (("dog", 3.0), ("boar", 5.0), ("deer", 8.0), ("moose", 3.0)):
        for speed in (50, 80):
            side = SIDES[number % 2]
            number += 1 if speed == 50 else 2
            yield _threat(
                "AnimalCrossing",
                "AnimalCrossing",
                speed,
                f"{animal}-{side}",
                animal=animal,
                animal_speed=running,
                side=side,
            )


def _sequences() -> Iterator[Case]:
    """Yield eight second threats, 3 and 6 s behind the first."""
    for first, speeds in (("car", (50, 80, 110)), ("pedestrian", (50,))):
        for speed in speeds:
            for pause in (3.0, 6.0):
                yield _threat(
                    "SecondThreat", "SecondThreat", speed, f"{first}-pause{pause:g}", first=first, pause=pause
                )


def everyday_threats() -> tuple[Case, ...]:
    """Return the 110 cases of everyday threats.

    CutInThreat 20, ClosingLead 18, HardBrakingLead 20, RollingCar 6, PedestrianTowards 4, BicycleTowards 4,
    StandingPerson 3, StandingChild 3, LyingPerson 6, LowBox 10, AnimalCrossing 8, SecondThreat 8. The family
    of a case is the name of its random levels, see `lgmd_gym.envs.families`; the speeds are assumptions.
    """
    groups = (_cut_ins, _leads, _towards, _persons, _boxes, _animals, _sequences)
    return tuple(case for group in groups for case in group())


def everyday_neighbours() -> tuple[Case, ...]:
    """Return the 43 neighbours of these threats: the same manoeuvres without a conflict.

    CutIn 5, CutInRecovers 3, Following 4, BrakeRelease 4, AdjacentSlower 5, Oncoming 2, BicyclePass 2,
    RoadsidePerson 6, BoxPass 6, ManholeCover 2, SteelPlate 1, AnimalClears 3.
    """
    return (*_free_cars(), *_free_road_users(), *_free_objects())


def _free_cars() -> Iterator[Case]:
    """Yield cars that cut in faster or recover, are followed, brake softly, or drive in another lane."""
    for speed in (50, 80, 120):
        yield _neighbour("CutIn", "CutIn", speed, "faster10", excess=to_mps(10), gap=8.0, left=speed != 80)
    for speed in (50, 80):
        yield _neighbour("CutIn", "CutIn", speed, "equal", excess=0.0, gap=round(0.8 * speed * KMH, 3))
    for speed, slower in ((50, 10), (80, 15), (120, 20)):
        yield _neighbour(
            "CutInRecovers",
            "CutIn",
            speed,
            f"slower{slower}",
            excess=-to_mps(slower),
            end_ttc=4.0,
            recovery=2.0,
            change_length=round(3.0 * (speed - slower) * KMH, 3),
        )
    for speed, headway in ((50, 0.8), (80, 0.8), (120, 1.0), (120, 2.0)):
        yield _neighbour("Following", "Following", speed, f"headway{headway:g}", headway=headway)
    for speed in (50, 80):
        for headway, drop in ((2.0, 3.0), (3.0, 6.0)):
            yield _neighbour(
                "BrakeRelease", "BrakeRelease", speed, f"headway{headway:g}", headway=headway, speed_drop=drop
            )
    for speed, slower, offset in (
        (50, 10, 3.5),
        (80, 5, -3.5),
        (80, 20, 3.5),
        (120, 20, 3.5),
        (130, 40, -3.5),
    ):
        tail = f"slower{slower}-{'left' if offset > 0 else 'right'}"
        target = to_mps(speed - slower)
        yield _neighbour(
            "AdjacentSlower", "AdjacentPass", speed, tail, target_speed=target, lateral_offset=offset
        )
    for oncoming in (2.0, 5.0):
        yield _neighbour("Oncoming", "Oncoming", 50, f"rolling{oncoming:g}", oncoming_speed=oncoming)


def _free_road_users() -> Iterator[Case]:
    """Yield bicycles and persons next to the ego's way, and animals that clear it."""
    for speed in (30, 50):
        yield _neighbour("BicyclePass", "BicyclePass", speed, "riding5", bicycle_speed=5.0)
    for speed in (30, 50, 70):
        for child in (False, True):
            yield _neighbour(
                "RoadsidePerson",
                "PedestrianPass",
                speed,
                "child" if child else "adult",
                walking_speed=0.0,
                child=child,
                clearance=1.0,
            )
    for speed, animal, running in ((50, "dog", 3.0), (80, "boar", 5.0), (80, "deer", 8.0)):
        yield _neighbour(
            "AnimalClears",
            "AnimalCrossing",
            speed,
            animal,
            animal=animal,
            animal_speed=running,
            clear_by=1.2,
        )


def _free_objects() -> Iterator[Case]:
    """Yield boxes next to the ego's way, and flat objects on it."""
    for speed in (50, 80):
        for height in (0.3, 0.8, 1.5):
            yield _neighbour(
                "BoxPass",
                "StandingBox",
                speed,
                f"height{height:g}",
                height=height,
                width=1.0,
                length=0.6,
                clearance=1.0,
                left=height == 0.8,
            )
    for speed, shade in ((50, 50), (80, 170)):
        yield _neighbour(
            "ManholeCover", "SteelPlate", speed, f"shade{shade}", shade=shade, length=0.7, width=0.7
        )
    yield _neighbour("SteelPlate", "SteelPlate", 80, "full-size")


def check_no_contact(row: Row) -> tuple[bool, str]:
    """Check a row of suite everyday-threats for contact and for premature braking."""
    return not row["collision"] and not row["premature_brake"], "no contact"


SUITES = (
    Suite(
        name=THREATS,
        cases=everyday_threats(),
        about="own cases: cut-ins, leads, persons, low boxes, animals, oncoming targets, second threats",
        limit=check_no_contact,
    ),
    Suite(
        name=NEIGHBOURS,
        cases=everyday_neighbours(),
        about="own cases: manoeuvres like everyday-threats without a conflict; braking is a false activation",
    ),
)
