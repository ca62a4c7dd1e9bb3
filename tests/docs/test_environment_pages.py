"""The pages of the environments: complete, and equal to what the environments are."""

import sys
from itertools import pairwise
from pathlib import Path

import gymnasium as gym
import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
sys.path.insert(0, str(DOCS))

from docstring_markdown import markdown_rows, rst_rows, sections  # noqa: E402
from environment_pages import all_cards, environment_page, id_of, overview_tables  # noqa: E402
from reference_returns import AGENTS, environments, measure, read_returns  # noqa: E402

from lgmd_gym.envs.traffic.env import TrafficEnv  # noqa: E402
from lgmd_gym.wrappers.observation import LGMDObservation  # noqa: E402

RETURNS = read_returns(DOCS / "returns.csv")
CARDS = {id_of(card): card for card in all_cards()}
HEADINGS = ("Description", "Action space", "Observation space", "Rewards", "Episode end", "Info", "Arguments",
            "Reference returns", "Version history")  # fmt: skip


def test_every_registered_id_has_a_page_and_returns():
    ids = {name for name in gym.registry if name.startswith("LGMD/")}
    assert set(CARDS) == set(environments()) == ids
    assert set(RETURNS) <= ids  # those of a new family are measured before a release
    for name, rows in RETURNS.items():
        expected = [(agent, environments()[name]) for agent in AGENTS]
        assert [(row.agent, row.episodes) for row in rows] == expected


@pytest.mark.parametrize(
    ("name", "entries"),
    [
        ("LGMD/CutIn-v0", ["| `excess` | ", "| `world` | `None` | "]),
        ("LGMD/RandomBraking-v0", ["| `split` | `'train'` | ", "| `level` | `int` | ", "### Reward, in"]),
        (
            "LGMD/RandomBrakingEasy-v0",
            ["| `families` | `('CCRs', ", "| `weathers` | `('clear',)` | ", "| `road` | `'smooth'` | "],
        ),
        ("LGMD/Scenario-v0", ["| `scenario` | – | ", "### Segment", "| `lateral_offset` | `0` | "]),
        ("LGMD/Traffic-TwoWay-v0", ["| `driver_acceleration` | `float` | ", "| `split` | `'train'` | "]),
    ],
)
def test_a_page_states_what_the_environment_is(name, entries):
    page = environment_page(CARDS[name], RETURNS[name])
    assert page.startswith(f"# {name}\n")
    assert [heading for heading in HEADINGS if f"\n## {heading}\n" not in page] == []
    assert [entry for entry in entries if entry not in page] == []
    assert ("| `weather` | `" in page) is ("RandomBraking" not in name)  # they have `weathers`
    assert "| `spike_frequency` | `(1,)` | `float32` | 0 to " in page
    assert "| `frame` | `(90, 160, 1)` | `uint8` | 0 to 255 | " in page
    assert "| `lgmd/fovea/ffi` | `float` | as in the observation" in page
    for heading, text in (("Action space", "demand"), ("Rewards", "contact"), ("Episode end", "runcat")):
        assert text in page.split(f"\n## {heading}\n")[1].split("\n## ")[0], heading
    assert "See `" not in page
    lines = page.splitlines()
    for line, following in pairwise(lines):
        if line.startswith("|") and following.startswith("|"):
            assert line.count("|") == following.count("|"), line


def test_the_stored_returns_are_those_of_the_environments():
    """If this fails after a change of dynamics or reward, run the command of docs/reference_returns.py."""
    name = "LGMD/CCRs-v0"
    for agent in ("random", "ttc-oracle"):
        stored = next(row for row in RETURNS[name] if row.agent == agent)
        again = measure(name, agent, stored.episodes)
        assert again.mean == pytest.approx(stored.mean, abs=1e-3)
        assert again.contacts == stored.contacts


def test_every_environment_is_listed_with_a_link():
    page = overview_tables(RETURNS)
    for name, card in CARDS.items():
        assert f"| [{name}](_generated/environments/{card.name}.md) | " in page
    threats, others = page.split("## Non-threats")
    assert "LGMD/CCRs-v0" in threats
    assert "LGMD/EmptyRoad-v0" in others


def test_tables_of_docstrings():
    assert markdown_rows("| a | b |\n|---|---|\n| 1 | |\n| 2 | x |") == [["1", ""], ["2", "x"]]
    rows = {row[0]: row[1:] for row in rst_rows(LGMDObservation)}
    assert rows["`ego_yaw_rate`"][1].endswith("positive to the right as in highway-env")
    assert rows["`lgmd/alert`"] == ["whether the spike frequency of any channel is >= t_sf"]
    assert set(sections(TrafficEnv)) >= {"Description", "Action Space", "Info", "Version History"}
    assert "Args" not in sections(TrafficEnv)["Arguments"]
