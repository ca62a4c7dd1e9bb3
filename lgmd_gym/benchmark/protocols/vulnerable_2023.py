"""Euro NCAP's test protocol AEB/LSS VRU v4.5.1 (February 2024, implementation 2023)."""

from lgmd_gym.benchmark.case import Case, Suite, make_case, speed_cases, to_mps
from lgmd_gym.benchmark.protocols.car_to_car_2023 import row_colour_2023, turns, without_targets

CROSSING = list(range(10, 65, 5))  # ego speeds [km/h]


def ncap2023_vru() -> tuple[Case, ...]:
    """Return the cases with pedestrians, bicycles and motorcycles, by day.

    CPNA-25 and -75, CPFA-50, CPNCO-50, CBNA-50, CBNAO-50 and CBFA-50 11 each, CPLA-25 7, CPLA-50 9, CPTA 8,
    CPRA 8, CBLA-25 7, CBLA-50 8, CMFtap 9. The two cases of CPTA with a turn to the right are beside the
    grid of 149 cells of the OpenSCENARIO files.
    """
    suite = "ncap2023-vru"
    return (
        *_located(suite, "CPNA", CROSSING, 25),
        *_located(suite, "CPNA", CROSSING, 75),
        *_located(suite, "CPFA", CROSSING, 50),
        *_located(suite, "CPNCO", CROSSING, 50),
        *_located(suite, "CPLA", list(range(50, 85, 5)), 25),
        *_located(suite, "CPLA", list(range(20, 65, 5)), 50),
        *_turning_pedestrians(suite),
        *_reversing(suite),
        *_located(suite, "CBNA", CROSSING, 50),
        *_located(suite, "CBNAO", CROSSING, 50),
        *_located(suite, "CBFA", CROSSING, 50),
        *_located(suite, "CBLA", list(range(50, 85, 5)), 25, bicycle_speed=to_mps(20)),
        *_located(suite, "CBLA", list(range(25, 65, 5)), 50, bicycle_speed=to_mps(15)),
        *turns(suite, "CMFtap"),
    )


def _located(
    suite: str, family: str, speeds: list[int], per_cent: int, **arguments: object
) -> tuple[Case, ...]:
    where = {"impact_location": per_cent / 100}
    return speed_cases(suite, family, speeds, f"/location{per_cent}", **where, **arguments)


def _turning_pedestrians(suite: str) -> tuple[Case, ...]:
    """Return CPTA: far side in both directions at 10 to 20 km/h, near side at 10 km/h."""
    rows: list[Case] = []
    for turn, speeds in (("left", [10, 15, 20]), ("right", [10])):
        for direction in ("same", "opposite"):
            tail = f"/{turn}-{direction}"
            rows += speed_cases(suite, "CPTA", speeds, tail, left=turn == "left", direction=direction)
    return tuple(rows)


def _reversing(suite: str) -> tuple[Case, ...]:
    """Return CPRA: a crossing adult at 4 and child at 8 km/h; six standing ones."""
    rows = [
        make_case(suite, "CPRA", f"v{speed}/crossing", ego_speed=to_mps(speed), child=speed == 8)
        for speed in (4, 8)
    ]
    for per_cent, child_speed in ((50, 8), (25, 4), (75, 4)):
        for speed in (4, 8):
            rows += _located(suite, "CPRA", [speed], per_cent, moving=False, child=speed == child_speed)
    return tuple(rows)


_VRU = Suite(
    name="ncap2023-vru",
    cases=ncap2023_vru(),
    about="Euro NCAP AEB VRU 2023: pedestrians, bicycles, CMFtap, by day",
    colour=row_colour_2023,
)
SUITES = (_VRU, without_targets(_VRU))
