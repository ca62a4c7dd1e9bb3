"""The arguments of every cell of the protocols against the grids of the documents, in km/h.

Sources: Euro NCAP AEB Car-to-Car v4.3.1, 8.2; AEB/LSS VRU v4.5.1; Frontal Collisions v1.1, 3.1; UN R152
Rev.2, 6.4 to 6.7; 49 CFR 571.127, S7.3 to S7.5 and table 2 of S8.1.1.
"""

from itertools import product

import pytest

from lgmd_gym.benchmark.suites import SUITES

SPEEDS = ("ego_speed", "target_speed", "walking_speed", "bicycle_speed")
TENS, FIVES = (10, 20, 30, 40, 50, 60), range(10, 65, 5)
G = 9.80665
DARK = ("night", "night_upper_beam")


def cell(**arguments):
    """Return a cell, with speeds in whole km/h, that can be compared."""
    return frozenset(arguments.items())


def cells(**axes):
    """Return all combinations of values; one that is no tuple or range is the same in all of them."""
    values = [value if isinstance(value, tuple | range) else (value,) for value in axes.values()]
    return {cell(**dict(zip(axes, item, strict=True))) for item in product(*values)}


def pairs(speeds, **axes):
    """Return the cells with these pairs of ego and target speeds."""
    return set().union(*(cells(ego_speed=ego, target_speed=target, **axes) for ego, target in speeds))


def found(suite, family, warned=False):
    """Return the cells of a family in a suite."""
    rows = []
    for case in SUITES[suite].cases:
        if (case.family, case.fcw_driver) == (family, warned):
            given = {
                name: round(value * 3.6, 3) if name in SPEEDS else value for name, value in case.arguments
            }
            rows.append(cell(**given))
    assert len({*rows}) == len(rows)
    return {*rows}


OVERLAPS = (-0.5, -0.75, 1.0, 0.75, 0.5)
TAP = {"ego_speed": (10, 15, 20), "target_speed": (30, 45, 60)}
NCAP_2023 = {
    ("CCRs", False): cells(ego_speed=range(10, 55, 5), overlap=OVERLAPS),
    ("CCRs", True): cells(ego_speed=range(55, 85, 5), overlap=OVERLAPS),
    ("CCRm", False): cells(ego_speed=range(30, 85, 5), overlap=OVERLAPS),  # behind 20 km/h, the default
    ("CCRb", False): cells(ego_speed=50, gap=(12, 40), deceleration=(2, 6), build_up=1),
    ("CCCscp", False): cells(ego_speed=(20, 30, 40, 50, 60), target_speed=(20, 30, 40, 50, 60), side="left")
    | cells(ego_speed=20, target_speed=(20, 30, 40, 50, 60), side="left", from_stop=True),
    ("CCFtap", False): cells(**TAP),
    ("CCFhos", False): pairs([(50, 50), (70, 70)]),
    ("CCFhol", False): pairs([(50, 50)], change_length=44, following_distance=13.9)
    | pairs([(70, 70)], change_length=60, following_distance=19.4),
}
NCAP_2023_VRU = {
    ("CPNA", False): cells(ego_speed=FIVES, impact_location=(0.25, 0.75)),
    ("CPFA", False): cells(ego_speed=FIVES, impact_location=0.5),
    ("CPNCO", False): cells(ego_speed=FIVES, impact_location=0.5),
    ("CPLA", False): cells(ego_speed=range(50, 85, 5), impact_location=0.25)
    | cells(ego_speed=range(20, 65, 5), impact_location=0.5),
    ("CPTA", False): cells(ego_speed=(10, 15, 20), left=True, direction=("same", "opposite"))
    | cells(ego_speed=10, left=False, direction=("same", "opposite")),
    ("CPRA", False): {
        *(cell(ego_speed=4, child=False), cell(ego_speed=8, child=True)),
        *(
            cell(ego_speed=speed, moving=False, impact_location=at, child=child)
            for speed, at, child in (
                *((4, 0.5, False), (8, 0.5, True), (4, 0.25, True), (8, 0.25, False)),
                *((4, 0.75, True), (8, 0.75, False)),
            )
        ),
    },
    ("CBNA", False): cells(ego_speed=FIVES, impact_location=0.5),
    ("CBNAO", False): cells(ego_speed=FIVES, impact_location=0.5),
    ("CBFA", False): cells(ego_speed=FIVES, impact_location=0.5),
    ("CBLA", False): cells(ego_speed=range(50, 85, 5), impact_location=0.25, bicycle_speed=20)
    | cells(ego_speed=range(25, 65, 5), impact_location=0.5, bicycle_speed=15),
    ("CMFtap", False): cells(**TAP),
}
SLOW_TARGET = [(ego, 20) for ego in (30, 40, 50, 60, 70, 80)]
FAST_TARGET = [(90, 30), (100, 40), (110, 50), (120, 60), (130, 70)]
HEAD_ON = [(30, 50), (40, 50), (50, 50), (60, 70), (70, 70), (80, 70)]
LEAD = {"headway": 1.0, "deceleration": 4.0}
INSIDE, MIDDLE, OUTSIDE, EDGES = (1.0, 0.75, 0.5, 0.25, 0.0), (0.75, 0.5, 0.25), (1.25, -0.25), (0.9, 0.1)


def by_light(**axes):
    return cells(**axes) | cells(**axes, weather="night")


SCP = cells(ego_speed=TENS[1:], target_speed=TENS[1:], side=("left", "right"), obstructed=True)
NCAP_2026 = {
    ("CCRs", False): cells(ego_speed=TENS[:5], impact_location=INSIDE),
    ("CCRs", True): cells(ego_speed=(60, 70, 80), impact_location=INSIDE),
    ("CCRm", False): pairs(SLOW_TARGET + FAST_TARGET, impact_location=INSIDE),
    ("CCRb", False): cells(ego_speed=range(30, 90, 10), impact_location=INSIDE, **LEAD),
    ("CCCscp", False): SCP,
    ("CCFtap", False): cells(**TAP),
    ("CCFhos", False): pairs(HEAD_ON, impact_location=MIDDLE),
    ("CMRs", False): cells(ego_speed=TENS[:5], impact_location=MIDDLE),
    ("CMRs", True): cells(ego_speed=(60, 70, 80), impact_location=MIDDLE),
    ("CMRb", False): cells(ego_speed=range(30, 90, 10), impact_location=MIDDLE, **LEAD),
    ("CMCscp", False): SCP,
    ("CMFtap", False): cells(**TAP),
    ("CPNA", False): by_light(ego_speed=TENS, impact_location=MIDDLE),
    ("CPFA", False): by_light(ego_speed=TENS, impact_location=0.5),
    ("CPNCO", False): by_light(ego_speed=TENS, impact_location=0.5),
    ("CPLA", False): by_light(ego_speed=TENS, impact_location=0.5),
    ("CPLA", True): by_light(ego_speed=(50, 60, 70, 80), impact_location=0.25),
    ("CBNA", False): cells(ego_speed=TENS, impact_location=(0.5, 0.75)),
    ("CBNAO", False): cells(ego_speed=TENS, impact_location=(0.5, 0.75)),
    ("CBFA", False): cells(ego_speed=TENS, impact_location=(0.25, 0.5)),
    ("CBLA", False): cells(ego_speed=TENS[1:], impact_location=0.5, bicycle_speed=15),
    ("CBLA", True): cells(ego_speed=(50, 60, 70, 80), impact_location=0.25, bicycle_speed=20),
}
FAST_SCP = cells(ego_speed=(20, 30), target_speed=(70, 80), side=("left", "right")) | cells(
    ego_speed=(70, 80), target_speed=(20, 30), side=("left", "right")
)
FAST_TAP = cells(ego_speed=(10, 15, 20, 25), target_speed=80) | cells(ego_speed=25, target_speed=(30, 45, 60))
NCAP_2026_EXTENDED = {
    ("CCRs", False): cells(ego_speed=TENS[:5], impact_location=OUTSIDE),
    ("CCRs", True): cells(ego_speed=(60, 70, 80), impact_location=OUTSIDE),
    ("CCRm", False): pairs(SLOW_TARGET + FAST_TARGET, impact_location=OUTSIDE),
    ("CCRb", False): cells(ego_speed=range(30, 90, 10), impact_location=OUTSIDE, **LEAD)
    | cells(ego_speed=range(90, 140, 10), impact_location=INSIDE + OUTSIDE, **LEAD),
    ("CCCscp", False): FAST_SCP,
    ("CCFtap", False): FAST_TAP,
    ("CCFhos", False): pairs(HEAD_ON, impact_location=1.0)
    | pairs([(90, 90), (100, 100)], impact_location=(1.0, 0.75, 0.5, 0.25)),
    ("CMRs", False): cells(ego_speed=TENS[:5], impact_location=EDGES),
    ("CMRs", True): cells(ego_speed=(60, 70, 80), impact_location=EDGES),
    ("CMRb", False): cells(ego_speed=range(30, 90, 10), impact_location=EDGES, **LEAD)
    | cells(ego_speed=range(90, 140, 10), impact_location=MIDDLE + EDGES, **LEAD),
    ("CMCscp", False): FAST_SCP,
    ("CMFtap", False): FAST_TAP,
    ("CPNA", False): by_light(ego_speed=TENS, impact_location=EDGES),
    ("CPFA", False): by_light(ego_speed=TENS, impact_location=(0.9, 0.75, 0.25, 0.1)),
    ("CPNCO", False): by_light(ego_speed=TENS, impact_location=(0.75, 0.25)),
    ("CPLA", False): by_light(ego_speed=TENS, impact_location=(0.75, 0.25, 0.1)),
    ("CPLA", True): by_light(ego_speed=(50, 60, 70, 80), impact_location=(0.75, 0.5, 0.1)),
    ("CBNA", False): cells(ego_speed=TENS, impact_location=(0.9, 0.25, 0.1)),
    ("CBNAO", False): cells(ego_speed=TENS, impact_location=(0.9, 0.25, 0.1)),
    ("CBFA", False): cells(ego_speed=TENS, impact_location=(0.9, 0.75, 0.1)),
    ("CBLA", False): cells(ego_speed=TENS[1:], impact_location=(0.75, 0.25, 0.1), bicycle_speed=15),
    ("CBLA", True): cells(ego_speed=(50, 60, 70, 80), impact_location=(0.75, 0.5, 0.1), bicycle_speed=20),
}
STANDING = {"ego_speed": (10, 20, 30, 40, 50, 55), "walking_speed": 0, "impact_location": 0.25}
ALONG = {"ego_speed": (*TENS, 65), "walking_speed": 5, "impact_location": 0.25}
REGULATIONS = {
    ("r152", "CCRs"): cells(ego_speed=(20, 40, 42, 60)),
    ("r152", "CCRm"): cells(ego_speed=(30, 60), target_speed=20),
    ("r152-vru", "CPNA"): cells(ego_speed=(20, 40, 42, 60), walking_speed=5, child=True),
    ("r152-vru", "CBNA"): cells(ego_speed=(20, 38, 40, 60), bicycle_speed=15, obstructed=False),
    ("fmvss127", "CCRs"): cells(ego_speed=range(10, 90, 10)),
    ("fmvss127", "CCRm"): cells(ego_speed=range(40, 90, 10), target_speed=20),
    ("fmvss127", "CCRb"): cells(
        ego_speed=(50, 80), gap=(12, 40), deceleration=(round(0.3 * G, 6), round(0.5 * G, 6)), build_up=1
    ),
    ("fmvss127-pedestrian", "CPNA"): cells(ego_speed=TENS, impact_location=0.25)
    | cells(ego_speed=TENS)
    | cells(ego_speed=TENS, weather=DARK),
    ("fmvss127-pedestrian", "CPFA"): cells(ego_speed=TENS),
    ("fmvss127-pedestrian", "CPNCO"): cells(ego_speed=TENS[:5]),
    ("fmvss127-pedestrian", "CPLA"): cells(**STANDING)
    | cells(**ALONG)
    | cells(**STANDING, weather=DARK)
    | cells(**ALONG, weather=DARK),
}
GRIDS = [
    *(("ncap2023", *key, grid) for key, grid in NCAP_2023.items()),
    *(("ncap2023-vru", *key, grid) for key, grid in NCAP_2023_VRU.items()),
    *(("ncap2026", *key, grid) for key, grid in NCAP_2026.items()),
    *(("ncap2026-extended", *key, grid) for key, grid in NCAP_2026_EXTENDED.items()),
    *((suite, family, False, grid) for (suite, family), grid in REGULATIONS.items()),
]


@pytest.mark.parametrize(("suite", "family", "warned", "grid"), GRIDS)
def test_cells_of_a_family(suite, family, warned, grid):
    assert found(suite, family, warned) == grid


def test_the_grids_cover_the_suites():
    for suite in {suite for suite, *_ in GRIDS}:
        known = {(family, warned) for name, family, warned, _ in GRIDS if name == suite}
        assert {(case.family, case.fcw_driver) for case in SUITES[suite].cases} == known


def test_loads_of_r152():
    """40 km/h (a bicycle: 38 km/h) at maximum mass, the others in running order."""
    loads = {case.name: case.load for suite in ("r152", "r152-vru") for case in SUITES[suite].cases}
    laden = {name for name, load in loads.items() if load == "laden"}
    assert laden == {"r152/CCRs/v40", "r152-vru/CPNA/v40", "r152-vru/CBNA/v38"}
    assert {*loads.values()} == {"laden", "unladen"}
