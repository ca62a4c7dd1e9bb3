"""Pages of the environments: everything that they state is read from the code, or measured by a command."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
from docstring_markdown import sections, table
from environment_tables import argument_tables, info_table, observation_table
from reference_returns import AGENTS, EXAMPLE, Returns, arguments_of

from lgmd_gym.envs import env_id
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.families import LEVELS
from lgmd_gym.envs.families.data import scenario_from_data
from lgmd_gym.envs.registration import RANDOM_TASKS, SCENARIO, traffic_id
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.report.gallery.cards import ScenarioCard, parse_docstring, scenario_cards

VIDEO_AGENT = "spike-threshold"
_NO_THREAT = "; not a threat."
_AGENT_NOTES = {
    "random": "draws every action from the action space",
    "spike-threshold": "is the rule of the paper, which brakes far too early in worlds: the camera moves, "
    "and the roadside passes",
    "ttc-oracle": "reads the true time to contact",
}


def all_cards() -> list[ScenarioCard]:
    """Return the cards of the gallery, and one of `LGMD/Scenario-v0` with an example scenario."""
    docstring = parse_docstring(scenario_from_data)._replace(
        summary="A scenario of your own, given as data or as a `Scenario`.", text="", arguments=()
    )
    return [
        *scenario_cards(),
        ScenarioCard(SCENARIO, env_id(SCENARIO), docstring, arguments={"scenario": EXAMPLE}),
    ]


def id_of(card: ScenarioCard) -> str:
    """Return the Gymnasium id of a card."""
    return traffic_id(card.name) if card.traffic else card.target


def environment_page(card: ScenarioCard, returns: Sequence[Returns]) -> str:
    """Return the page of one environment; `returns` are those of the reference agents."""
    name, cls = id_of(card), TrafficEnv if card.traffic else BrakingEnv
    env: Any = gym.make(name, include_frame=True, include_base=True, **arguments_of(name))
    _, info = env.reset(seed=0)
    parts = sections(cls)
    observation = env.observation_space
    end = parts["Episode End"]
    if not card.traffic and card.name not in RANDOM_TASKS:
        end += f"\n\nWith the default arguments, the duration is {env.unwrapped.scenario.duration:.1f} s."
    text = [
        f"# {name}",
        card.docstring.summary,
        _video(card),
        _overview(name, env, card.traffic),
        "## Description",
        _without_headings(card.docstring.text),
        parts["Description"],
        _example(name),
        f"## Action space\n\n{parts['Action Space']}",
        "## Observation space\n\nA `Dict` with these entries; `frame` only with `include_frame=True`, and "
        "`base` only with `include_base=True`:",
        observation_table(observation),
        f"`base`, the environment's own observation: {parts['Observation Space'].split('. ')[0]}.",
        f"## Rewards\n\n{parts['Rewards']}",
        f"## Episode end\n\n{end}",
        "## Info\n\nUndefined values are `inf`.",
        info_table(info, cls),
        f"## Arguments\n\n{argument_tables(card, cls)}",
        f"## Reference returns\n\n{returns_table(returns)}",
        f"## Version history\n\n{parts['Version History']}",
    ]
    env.close()
    return "\n\n".join(part for part in text if part) + "\n"


def _video(card: ScenarioCard) -> str:
    source = f"../../_static/{card.name}"
    files = f'src="{source}.mp4" poster="{source}.jpg"'
    tag = f'<video {files} controls muted loop preload="none" width="100%"></video>'
    return f"```{{raw}} html\n{tag}\n```\n\nThe agent in the video is `{VIDEO_AGENT}`, with seed 0."


def _overview(name: str, env: Any, traffic: bool) -> str:
    required = ", scenario=..." if arguments_of(name) else ""
    many = "`gym.vector.SyncVectorEnv`" if traffic else f'`gym.make_vec("{name}", num_envs=8{required})`'
    return table(
        ("", ""),
        (
            ("Create", f'`gym.make("{name}"{required})`, after `import lgmd_gym`'),
            ("Many at once", many),
            ("Action space", f"`{env.action_space}`"),
            ("Observation space", "`Dict`, [see below](#observation-space)"),
            ("Decisions", f"{env.unwrapped.config['policy_frequency']} per second"),
        ),
    )


def _example(name: str) -> str:
    """Return the example of `LGMD/Scenario-v0`; empty for other environments."""
    if name != env_id(SCENARIO):
        return ""
    return f"The video and the reference returns are of this scenario:\n\n```python\n{EXAMPLE}\n```"


def returns_table(returns: Sequence[Returns]) -> str:
    """Return the results of the reference agents as a Markdown table."""
    if not returns:
        return "Not measured yet."
    rows = [
        (
            f"`{item.agent}`",
            f"{item.mean:.2f} ± {item.std:.2f}",
            f"{item.contacts}/{item.episodes}",
            f"{item.duration:.1f} s",
        )
        for item in sorted(returns, key=lambda item: AGENTS.index(item.agent))
    ]
    notes = "; ".join(f"`{name}` {text}" for name, text in _AGENT_NOTES.items())
    return (
        "Mean ± standard deviation of the undiscounted return with the default arguments, by "
        "`python docs/reference_returns.py docs/returns.csv`. The episodes have the seeds 0 to "
        f"{returns[0].episodes - 1} and different training worlds. {notes}.\n\n"
        + table(("agent", "return", "contacts", "mean duration"), rows)
    )


def overview_tables(returns: Mapping[str, Sequence[Returns]]) -> str:
    """Return the tables of all environments, with mean returns, for the page that lists them."""
    groups: dict[str, list[tuple[str, ...]]] = {
        "Threats": [], "Non-threats": [], "Random and own scenarios": [], "Traffic": [],
    }  # fmt: skip
    for card in all_cards():
        if card.traffic:
            group = "Traffic"
        elif card.name in (*RANDOM_TASKS, SCENARIO):
            group = "Random and own scenarios"
        else:
            group = "Threats" if LEVELS[card.name].threat else "Non-threats"
        means = {item.agent: f"{item.mean:.1f}" for item in returns.get(id_of(card), ())}
        link = f"[{id_of(card)}](_generated/environments/{card.name}.md)"
        scene = card.docstring.summary.removesuffix(_NO_THREAT).rstrip(".")
        groups[group].append((link, scene, *(means.get(agent, "–") for agent in AGENTS)))
    headings = ("id", "scene", *(f"`{agent}`" for agent in AGENTS))
    return "\n\n".join(f"## {group}\n\n{table(headings, rows)}" for group, rows in groups.items()) + "\n"


def _without_headings(text: str) -> str:
    """Return the text of a docstring without its headings."""
    return "\n\n".join(part for part in text.split("\n\n") if not part.startswith("#"))
