"""Every case with an impact location has its contact there without braking, within 1 cm."""

import pytest
from support.contacts import ADULT_HIP, CHILD_HIP, CRANK, EGO_WIDTH, Contact

from lgmd_gym.benchmark.suites import SUITES

POINTS = {
    "CPNA": ADULT_HIP,
    "CPFA": ADULT_HIP,
    "CPNCO": CHILD_HIP,
    "CBNA": CRANK,
    "CBNAO": CRANK,
    "CBFA": CRANK,
}
AHEAD = ("CCRs", "CCRm", "CCRb", "CMRs", "CMRb", "CPLA", "CBLA", "CCFhos")
TOLERANCE = 0.01  # [m]


def deviation(case):
    """Return how far the contact is beside the impact location, and before the ego's front [m]."""
    arguments = dict(case.arguments)
    child = arguments.get("child", case.family == "CPNCO")
    contact = Contact(case.scenario)
    moving = case.family in POINTS or (case.family == "CPRA" and arguments.get("moving", True))
    point = CHILD_HIP if child else POINTS.get(case.family, ADULT_HIP if moving else 0.0)
    _, across = contact.from_front(point, 0.0)
    half = contact.target.WIDTH / 2 if moving else contact.target.LENGTH / 2
    corners = [
        contact.from_front(0.0, side) if moving else contact.from_front(side, 0.0) for side in (-half, half)
    ]
    wanted = (arguments.get("impact_location", 0.5) - 0.5) * EGO_WIDTH
    return across - wanted, min(ahead for ahead, _ in corners)


@pytest.mark.parametrize(
    "suite",
    [
        *("ncap2023-vru", "ncap2026", "r152-vru", "fmvss127-pedestrian"),
        pytest.param("ncap2026-extended", marks=pytest.mark.slow),
    ],
)
def test_contact_is_at_the_impact_location(suite):
    cases = [case for case in SUITES[suite].cases if case.family in (*POINTS, *AHEAD, "CPRA")]
    assert len(cases) > 5
    missed = {}
    for case in cases:
        beside, before = deviation(case)
        if abs(beside) > TOLERANCE or abs(before) > TOLERANCE:
            missed[case.name] = beside, before
    assert not missed
