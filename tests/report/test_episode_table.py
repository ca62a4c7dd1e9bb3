"""`episodes.csv`: columns, units, nulls and order."""

import csv
import re

from support.rows import threat_row

from lgmd_gym.benchmark.metrics import KEYS
from lgmd_gym.benchmark.summary import UNITS, column_name, write_episodes
from lgmd_gym.benchmark.traffic.rows import KEYS as TRAFFIC_KEYS

# Names, flags, counts, values with their unit in the key, and grey levels or returns without a unit.
WITHOUT_UNIT = {
    *("agent", "suite", "case", "fcw_driver", "seed", "condition", "world", "camera", "side", "error"),
    *("threat", "collision", "avoided", "false_activation", "premature_brake"),
    *("false_alert", "braking_onsets"),
    *("alerts", "brakes", "false_activations", "stops", "needless_activations", "activations"),
    *("avoidable", "avoided_by_brake", "caused"),
    *("family", "overlap", "impact_location", "target_side", "light", "load"),
    *("theta_at_alert_deg", "l_over_v_ms", "target_shade", "episode_return"),
}


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_key_of_a_row_has_its_unit_or_needs_none():
    assert {*KEYS, *TRAFFIC_KEYS} == UNITS.keys() | WITHOUT_UNIT
    assert not UNITS.keys() & WITHOUT_UNIT
    for key in UNITS:
        assert re.fullmatch(rf"{key}_(m|s|m_s|m_s2|hz)", column_name(key))


def test_columns_and_values(tmp_path):
    error = "Traceback:\n  File x\nValueError: a, b\n"
    row = threat_row(impact_speed=2.5, collision=True, avoided=False, world=None, error=error)
    write_episodes([row], tmp_path / "episodes.csv")
    (line,) = read(tmp_path / "episodes.csv")
    assert list(line) == [column_name(key) for key in KEYS]
    assert (line["impact_speed_m_s"], line["collision"], line["avoided"]) == ("2.5", "true", "false")
    assert line["world"] == line["min_ttc_s"] == ""  # null, not 0
    assert line["error"] == "ValueError: a, b"


def test_zero_is_not_null(tmp_path):
    write_episodes([threat_row(seed=0, min_ttc=0.0)], tmp_path / "episodes.csv")
    (line,) = read(tmp_path / "episodes.csv")
    assert (line["seed"], line["min_ttc_s"]) == ("0", "0.0")


def test_order_does_not_depend_on_the_order_of_completion(tmp_path):
    rows = [
        threat_row(agent, f"suite/CCRs/v{speed}", seed)
        for speed in (5, 10, 50)
        for agent in ("a", "b")
        for seed in (0, 1)
    ]
    write_episodes(rows, tmp_path / "forward.csv")
    write_episodes(rows[::-1], tmp_path / "backward.csv")
    assert (tmp_path / "forward.csv").read_bytes() == (tmp_path / "backward.csv").read_bytes()
    assert [line["case"] for line in read(tmp_path / "forward.csv")][::4] == [
        "suite/CCRs/v5",
        "suite/CCRs/v10",
        "suite/CCRs/v50",
    ]
