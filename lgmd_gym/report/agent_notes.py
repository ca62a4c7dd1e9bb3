"""One sentence on what each agent of a report is."""

import inspect
import re

from lgmd_gym.agents.policies.card import policy_card, read_card
from lgmd_gym.agents.policies.policy import Policy, find_policy
from lgmd_gym.agents.registry import AGENTS, make_agent
from lgmd_gym.errors import counted

SENTENCE_END = re.compile(r"(?<=[^.].[.!?])(?=\s|$)")


def agent_note(text: str, trusted: bool = True) -> str:
    """Return one sentence on an agent: the summary of its class, or the card of its policy.

    The card of a policy is data; reading it does not load the model.

    Args:
        text: Agent string, see `lgmd_gym.agents.make_agent`.
        trusted: Whether a class from outside this package may be loaded.
    """
    name, _, rest = text.partition(":")
    if name == Policy.name:
        return _policy_note(rest)
    if name in AGENTS:
        return _first_sentence(AGENTS[name])
    if not trusted:
        return "A class from outside this package, which was not loaded."
    try:
        agent = make_agent(text)
    except Exception:  # any error of the user's module or constructor
        return "A class from outside this package, which cannot be loaded."
    return _first_sentence(type(getattr(agent.agent, "objects", [agent.agent])[0]))


def _first_sentence(kind: type) -> str:
    """Return the first sentence of a class docstring on one line, without Markdown marks."""
    text = inspect.getdoc(kind) if kind.__doc__ else None
    paragraph = " ".join((text or "").split("\n\n")[0].split()).replace("`", "")
    return SENTENCE_END.split(paragraph)[0] or "A class from outside this package, without a docstring."


def _policy_note(path: str) -> str:
    """Return the algorithm, cameras, inputs and demands of a policy."""
    try:
        file = find_policy(path)
        card, training = policy_card(file), read_card(file).get("config")
    except ValueError:
        return "A learned policy, whose card cannot be read."
    cameras = len(card.camera) if isinstance(card.camera, list | tuple) else 1
    inputs = (
        "the observations of the environment" if card.features is None else ", ".join(card.features.inputs)
    )
    demands = f"{len(card.demands)} levels of demand" if card.demands else "a continuous demand"
    sensors = counted(cameras, "camera")
    algo = training.get("algo") if isinstance(training, dict) else card.algo
    method = "offline training" if algo == "offline" else str(algo).upper()
    return f"Learned policy ({method}) with {sensors}, the inputs {inputs}, and {demands}."
