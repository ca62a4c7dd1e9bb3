"""The conclusion of a report and the sentences on agents, from hand-made rows."""

import pytest
from support.rows import suite_rows, threat_row

from lgmd_gym.benchmark.case import Suite
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.report.conclusion import CAVEAT, agent_note
from lgmd_gym.report.conclusion import conclusion as points

SUITE = Suite(name="suite", cases=(), about="")
AGENTS = ["no-brake", "rule"]


def conclusion(rows, agents, suite):
    """Return the points of the conclusion as one text."""
    return " ".join(filter(None, points(rows, agents, suite)))


def row(agent, number, threat=True, **values):
    """Return a row of a case of its own; `avoided` is undefined without a threat."""
    flags = {
        "collision": False,
        "avoided": threat or None,
        "false_activation": False,
        "premature_brake": False,
    }
    speeds = {"ego_speed": 10.0, "speed_reduction": 5.0 if threat else None}
    case = f"suite/CCRs/v{number}"
    return threat_row(agent, case, suite="suite", threat=threat) | flags | speeds | values


def run(threats, non_threats, contacts=0, false=0):
    """Return rows of no-brake and of an agent with some contacts and false activations."""
    rows = []
    for number in range(threats):
        contact = number < contacts
        rows.append(row("no-brake", number, collision=True, avoided=False))
        rows.append(row("rule", number, collision=contact, avoided=not contact))
    for number in range(threats, threats + non_threats):
        rows.append(row("no-brake", number, threat=False))
        rows.append(row("rule", number, threat=False, false_activation=number - threats < false))
    return rows


@pytest.mark.parametrize(
    ("numbers", "sentence"),
    [
        (
            {"threats": 4, "non_threats": 3},
            "rule avoided 4 of 4 threats [51 to 100 %] and activated falsely in 0 of 3 "
            "episodes [0 to 56 %] without a threat.",
        ),
        (
            {"threats": 4, "non_threats": 1, "contacts": 4, "false": 1},
            "rule avoided 0 of 4 threats [0 to 49 %] and activated falsely in 1 of 1 episode "
            "[21 to 100 %] without a threat.",
        ),
        (
            {"threats": 4, "non_threats": 2, "contacts": 1},
            "rule avoided 3 of 4 threats [30 to 95 %] and activated falsely in 0 of 2 episodes",
        ),
        (
            {"threats": 2, "non_threats": 0},
            "rule avoided 2 of 2 threats [34 to 100 %]. No episode is without a threat: false "
            "activations were not measured.",
        ),
        (
            {"threats": 0, "non_threats": 2},
            "rule activated falsely in 0 of 2 episodes [0 to 66 %] without a threat. No "
            "episode has a threat: avoidance was not measured.",
        ),
    ],
    ids=["all", "none", "mixed", "no non-threat", "no threat"],
)
def test_avoided_and_false_activations_have_their_n_and_interval(numbers, sentence):
    text = conclusion(run(**numbers), AGENTS, SUITE)
    assert sentence in text
    total = numbers["threats"] + numbers["non_threats"]
    assert f"Without braking, {numbers['threats']} of {total} episode" in text
    contents = f"{2 * total} episodes of suite suite ({total} cases in the laboratory)"
    assert text.startswith(f"The run contains {contents}.")
    assert "Brackets contain the 95 % interval, clustered by case and world." in text
    assert text.endswith(CAVEAT)
    assert "\n" not in text


def test_failed_episodes_are_counted_and_left_out():
    rows = run(2, 1)
    rows += [row("rule", 9, error="x"), row("rule", 8, error="x")]
    text = conclusion(rows, AGENTS, SUITE)
    assert "2 episodes failed and are left out." in text
    assert "avoided 2 of 2 threats" in text
    assert "failed" not in conclusion(run(2, 1), AGENTS, SUITE)


def test_an_agent_without_a_completed_episode():
    rows = [item for item in run(1, 0) if item["agent"] == "no-brake"] + [row("rule", 0, error="x")]
    assert "rule has no completed episode." in conclusion(rows, AGENTS, SUITE)


def test_an_agent_that_completed_one_kind_of_episodes_only():
    rows = [item for item in run(2, 1) if item["agent"] == "no-brake" or item["threat"]]
    text = conclusion(rows, AGENTS, SUITE)
    assert "[34 to 100 %] and completed no episode without a threat." in text


def test_premature_braking_is_named_beside_the_avoided_threats():
    rows = run(2, 1)
    rows[1] |= {"avoided": False, "premature_brake": True}
    text = conclusion(rows, AGENTS, SUITE)
    assert "avoided 1 of 2 threats [9 to 91 %] with premature braking in 1 other and" in text
    assert "premature" not in conclusion(run(2, 1), AGENTS, SUITE)


def test_agents_are_in_the_order_of_avoided_threats():
    rows = run(3, 0, contacts=2)
    rows += [item | {"agent": "better", "avoided": True} for item in rows if item["agent"] == "rule"]
    sample, scores, limits = points(rows, ["no-brake", "rule", "better"], SUITE)
    assert scores.startswith("better avoided 3 of 3 threats")
    assert scores.index("rule avoided 1 of 3") > 0
    assert sample.startswith("The run contains 9 episodes")
    assert limits == CAVEAT


def test_every_condition_has_its_sentences():
    rows = run(2, 1) + [item | {"condition": "rain"} for item in run(2, 1, contacts=2)]
    text = conclusion(rows, AGENTS, SUITE)
    assert "Condition clear: rule avoided 2 of 2" in text
    assert "Condition rain: rule avoided 0 of 2" in text
    assert "Condition" not in conclusion(run(2, 1), AGENTS, SUITE)


def test_the_laboratory_and_worlds_are_no_conditions():
    rows = [item | {"world": 8000} for item in run(2, 1)]
    text = conclusion([*rows, *(item | {"world": None} for item in run(2, 1, contacts=2))], AGENTS, SUITE)
    assert "In worlds: rule avoided 2 of 2" in text
    assert "In the laboratory: rule avoided 0 of 2" in text
    assert "Condition" not in text


def test_episodes_with_an_fcw_driver_are_not_in_the_totals():
    rows = [*run(2, 1), row("rule", 7, fcw_driver=True, collision=True, avoided=False)]
    assert "rule avoided 2 of 2 threats" in conclusion(rows, AGENTS, SUITE)


def test_limits_of_the_protocol():
    rows = [
        item | {"avoided": not item["collision"], "premature_brake": False, "speed_reduction": 0.0}
        for item in suite_rows("r152", lambda case, _: "CCRs/v60" in case)
    ]
    rows += [item | {"seed": 1, "collision": False, "relative_impact_speed": None} for item in rows]
    text = conclusion(rows, ["no-brake", "a"], SUITES["r152"])
    assert "Cases in which every run meets the limit of the protocol in simulation: a " in text
    met, cases = text.split("in simulation: a ")[1].split(".")[0].split(" of ")
    assert int(met) == int(cases) - 1
    assert "No verdict on the impact speed limits of UN R152: 12 runs per agent, 30 are needed." in text
    many = [item | {"seed": seed} for item in rows[:6] for seed in range(5)]
    text = conclusion(many, ["no-brake", "a"], SUITES["r152"])
    meets = "Meets the impact speed limits of UN R152 in simulation, in the laboratory, 30 runs or more: "
    assert f"{meets}none." in text  # CCRs/v60 fails in 5 of 30 runs
    many = [item | {"collision": False, "relative_impact_speed": None, "world": 8000} for item in many]
    assert f"{meets.replace('the laboratory', 'worlds')}a." in conclusion(many, ["a"], SUITES["r152"])
    assert "limit" not in conclusion(run(1, 1), AGENTS, SUITE)


@pytest.mark.parametrize(
    ("agent", "note"),
    [
        ("no-brake", "Never brakes."),
        ("spike-threshold:threshold=45", "Brakes fully when the spike frequency reaches a threshold."),
        ("policy:all-round", "Learned policy (time-to-brake) with 25 cameras, the inputs columns, sides_ffi"),
        ("policy:missing.zip", "A learned policy, whose card cannot be read."),
        ("no_such_module:Agent", "A class from outside this package, which cannot be loaded."),
    ],
)
def test_agent_notes(agent, note):
    assert agent_note(agent).startswith(note)


def test_note_on_a_class_of_the_user_is_loaded_only_if_trusted(tmp_path, monkeypatch):
    source = (
        'class Mine:\n    """Brakes for\n    `cows`. Slowly."""\n    def act(self, o, i):\n        return 0.0'
    )
    (tmp_path / "cow_rules.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    assert agent_note("cow_rules:Mine", trusted=False).endswith("which was not loaded.")
    assert agent_note("cow_rules:Mine") == "Brakes for cows."
