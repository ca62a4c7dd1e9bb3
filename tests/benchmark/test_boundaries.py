"""Gates, bands and limits of the protocols at their boundaries and just beside them, by hand.

The sources are Euro NCAP AEB Car-to-Car v4.3.1 and Safety Assist v10.4.1, Frontal Collisions v1.1, 5.3, and
UN R152 Rev.2, 5.2.
"""

import numpy as np
import pytest
from support.rows import suite_rows, threat_row

from lgmd_gym.agents.base import BatchAgent
from lgmd_gym.benchmark.fcw_driver import FCWDriver
from lgmd_gym.benchmark.protocols.car_to_car_2023 import is_gated, points_2023, row_colour_2023
from lgmd_gym.benchmark.protocols.frontal_2026 import colour_2026, points_2026, row_colour_2026
from lgmd_gym.benchmark.protocols.regulations import check_r152, r152_limit
from lgmd_gym.envs.dynamics.units import KMH


def points_with_contact(suite, points, family, speed):
    """Return the points by scenario if the ego has contact in the cases of a family at a speed [km/h]."""
    rows = suite_rows(suite, lambda name, kmh: name.split("/")[1] == family and kmh == speed)
    return {item.scenario: item.earned for item in points(rows, "a")}


@pytest.mark.parametrize("speed", [10, 15, 20])
def test_gate_of_2023_closes_up_to_20_kmh(speed):
    earned = points_with_contact("ncap2023", points_2023, "CCRs", speed)
    assert earned == {"CCRs": 0.0, "CCRs, warned driver": 0.0, "CCRm": 15.0, "CCRb": 4.0}


def test_gate_of_2023_is_open_from_25_kmh():
    # The row of 25 km/h has 2 of 14 points.
    earned = points_with_contact("ncap2023", points_2023, "CCRs", 25)
    assert earned == {"CCRs": pytest.approx(12.0), "CCRs, warned driver": 6.0, "CCRm": 15.0, "CCRb": 4.0}


@pytest.mark.parametrize(
    ("speed", "share"), [(10, 0.0), (20, 0.0), (30, 35 / 40), (50, 35 / 40), (60, 35 / 40)]
)
def test_gate_of_2026(speed, share):
    """Five of the 40 cells of CCRs have contact; up to 20 km/h no family earns points."""
    earned = points_with_contact("ncap2026", points_2026, "CCRs", speed)
    rest = 1.0 if share else 0.0
    assert earned == pytest.approx({"CCRs": 1.2 * share, "CCRm": 2.4 * rest, "CCRb": 1.6 * rest})


def test_only_contacts_in_ccrs_close_the_gate():
    def row(speed, collision=True, family="CCRs"):
        return threat_row(case=f"s/{family}/v", ego_speed=speed * KMH, collision=collision)

    assert [is_gated([row(speed)]) for speed in (5, 10, 20, 20.4, 20.6, 25)] == [True] * 4 + [False] * 2
    assert not is_gated([row(20, collision=False), row(10, family="CCRm"), row(10, family="CMRs"), row(25)])
    assert is_gated([row(20, collision=False), row(20)])
    assert not is_gated([])


@pytest.mark.parametrize(
    ("impact", "colour"),
    [
        *((0.01, "green"), (4.99, "green"), (5.0, "yellow"), (14.99, "yellow"), (15.0, "orange")),
        *((29.99, "orange"), (30.0, "brown"), (39.99, "brown"), (40.0, "red"), (50.0, "red")),
    ],
)
def test_bands_of_2023_at_50_kmh(impact, colour):
    for family in ("CCRs", "CCRb"):
        # 1e-9 more, because whole speeds in km/h are not exact in m/s.
        values = {"collision": True, "impact_speed": impact * KMH + 1e-9, "ego_speed": 50 * KMH}
        assert row_colour_2023(threat_row(case=f"s/{family}/v50", **values)) == colour


@pytest.mark.parametrize(
    ("speeds", "bands"),
    [
        ((5, 10, 15, 20, 29.9), ((0.01, "red"), (60, "red"))),
        ((30, 39.9), ((0.01, "brown"), (9.99, "brown"), (10, "red"))),
        ((40, 49.9), ((0.01, "orange"), (9.99, "orange"), (10, "brown"), (19.99, "brown"), (20, "red"))),
        (
            (50, 60, 90, 130),
            (
                *((0.01, "yellow"), (9.99, "yellow"), (10, "orange"), (19.99, "orange")),
                *((20, "brown"), (29.99, "brown"), (30, "red")),
            ),
        ),
    ],
)
def test_bands_of_2026(speeds, bands):
    for speed in speeds:
        assert colour_2026(speed, 0.0) == "green"
        assert [colour_2026(speed, impact) for impact, _ in bands] == [colour for _, colour in bands]


def test_colours_of_2026_are_known_for_rear_ends_of_cars():
    values = {
        "collision": True,
        "ego_speed": 50 * KMH,
        "relative_impact_speed": 12 * KMH,
        "impact_speed": 32 * KMH,
    }
    found = [
        row_colour_2026(threat_row(case=f"s/{family}/v50", **values)) for family in ("CCRs", "CCRm", "CCRb")
    ]
    assert found == ["orange"] * 3
    assert row_colour_2026(threat_row(case="s/CMRs/v50", **values)) == "contact"
    assert (
        row_colour_2026(
            threat_row(case="s/CMRs/v50", **values | {"collision": False, "relative_impact_speed": None})
        )
        == "green"
    )


@pytest.mark.parametrize(
    ("target", "steps"),
    [
        # highest relative speed [km/h] of each column, limit laden and in running order
        ("car", ((40, 0, 0), (42, 10, 0), (45, 15, 15), (50, 25, 25), (55, 30, 30), (60, 35, 35))),
        ("pedestrian", ((40, 0, 0), (42, 10, 0), (45, 15, 15), (50, 25, 25), (55, 30, 30), (60, 35, 35))),
        ("bicycle", ((38, 0, 0), (40, 10, 0), (45, 25, 25), (50, 30, 30), (55, 35, 35), (60, 40, 40))),
    ],
)
def test_limits_of_r152_between_their_columns(target, steps):
    lowest = 0.0
    for speed, laden, unladen in steps:
        for relative in (lowest + 0.01, speed):
            found = r152_limit(relative, "laden", target), r152_limit(relative, "unladen", target)
            assert found == (laden, unladen), relative
        lowest = speed
    with pytest.raises(ValueError, match=r"at most 60, the highest speed in UN R152, got 60\.01"):
        r152_limit(60.01, "laden", target)


@pytest.mark.parametrize(
    ("case", "speed", "limit"),
    [("r152/CCRs/v60", 60, 35), ("r152-vru/CPNA/v60", 60, 35), ("r152-vru/CBNA/v60", 60, 40)],
)
def test_impact_speeds_at_the_limit_of_r152(case, speed, limit):
    for impact, met in ((limit - 0.01, True), (limit, True), (limit + 0.01, False)):
        speeds = {"ego_speed": speed * KMH, "target_speed": 0.0, "relative_impact_speed": impact * KMH}
        assert check_r152(threat_row(case=case, collision=True, **speeds))[0] is met


class Alarm(BatchAgent):
    """Alerts in each environment at given decisions, and always demands full braking."""

    name = "alarm"

    def __init__(self, *decisions):
        super().__init__()
        self.decisions, self.now = decisions, -1
        self._allocate(len(decisions))

    def demands(self, observations, infos, active):
        self.now += 1
        self.alerts = np.array([self.now in alerts for alerts in self.decisions])
        return np.full(self.num_envs, -1.0)


def driver_demands(hz, count, alerts, limits=(9.0,)):
    """Return the demands of a driver over `count` decisions, shape (count, environments)."""
    driver = FCWDriver(Alarm(*alerts), lambda: np.array(limits), hz)
    return np.array([driver.act({}, {}).copy() for _ in range(count)])


@pytest.mark.parametrize(("hz", "delay"), [(30.0, 36), (15.0, 18), (25.0, 30), (60.0, 72), (10.0, 12)])
def test_driver_brakes_1_2_s_after_the_alert_to_the_decision(hz, delay):
    demands = driver_demands(hz, delay + 9, [(0,)])[:, 0]
    assert demands.tolist() == [0.0] * delay + [pytest.approx(-4 / 9)] * 9
    demands = driver_demands(hz, delay + 9, [(5,)])[:, 0]
    assert np.flatnonzero(demands)[0] == 5 + delay


def test_driver_counts_from_the_first_alert_in_each_environment():
    demands = driver_demands(30.0, 60, [(3, 4, 20), (10,), ()], limits=(8.0, 5.0, 9.0))
    assert [np.flatnonzero(column)[:1].tolist() for column in demands.T] == [[39], [46], []]
    # 4 m/s² as a share of each brake.
    assert demands[-1] == pytest.approx((-0.5, -0.8, 0.0))
    assert not driver_demands(30.0, 50, [(0,)], limits=(0.0,)).any()  # no episode yet


def test_driver_forgets_the_alert_of_the_last_episode():
    driver = FCWDriver(Alarm((2,), (2,)), lambda: np.full(2, 8.0), 30.0)
    demands = []
    for decision in range(45):
        if decision == 20:
            driver.reset(np.array([True, False]))
        demands.append(driver.act({}, {}).copy())
    assert [np.flatnonzero(column).tolist() for column in np.array(demands).T] == [[], [*range(38, 45)]]
