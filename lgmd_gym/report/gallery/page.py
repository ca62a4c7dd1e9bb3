"""The gallery page, rendered from `gallery.html`."""

import re
from collections.abc import Mapping, Sequence

from markupsafe import Markup, escape

from lgmd_gym._version import __version__
from lgmd_gym.report.gallery.cards import ScenarioCard
from lgmd_gym.report.gallery.outcomes import AgentOutcome

ImageSheet = Mapping[str, Mapping[str, str]]  # row -> column -> file name


def render_page(
    cards: Sequence[ScenarioCard],
    outcomes: Mapping[str, Mapping[str, AgentOutcome]],
    sheets: Mapping[str, ImageSheet],
    agent: str,
    seeds: int,
) -> str:
    """Return the page as HTML.

    Args:
        cards: Scenarios, whose videos are in `media/`.
        outcomes: Outcomes by scenario name and agent; empty for traffic.
        sheets: Image sheets "cameras" and "roads"; may be empty.
        agent: Agent in the videos.
        seeds: Number of seeds per scenario behind the outcomes.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("lgmd_gym.report.gallery", "."), autoescape=True, undefined=StrictUndefined
    )
    environment.filters |= {"code": _code, "paragraphs": _paragraphs}
    groups: dict[str, list[ScenarioCard]] = {"threats": [], "non-threats": [], "traffic": []}
    for card in cards:
        groups[_group(card, outcomes[card.name])].append(card)
    example = next((card.name for card in cards if card.name == "CCRs"), cards[0].name)
    return environment.get_template("gallery.html").render(
        groups=groups, outcomes=outcomes, sheets=sheets, agent=agent, seeds=seeds, example=example,
        version=__version__,
    )  # fmt: skip


def _group(card: ScenarioCard, outcomes: Mapping[str, AgentOutcome]) -> str:
    """Return the section of a card; a threat is a scenario in which no-brake has contact."""
    if card.traffic:
        return "traffic"
    return "threats" if outcomes["no-brake"].threat else "non-threats"


def _code(text: str) -> Markup:
    """Return docstring text as HTML, with text in backticks as code."""
    return Markup(re.sub(r"`+([^`]+)`+", r"<code>\1</code>", str(escape(" ".join(text.split())))))


def _paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a docstring without its headings."""
    return [part for part in text.split("\n\n") if part.strip() and not part.startswith("#")]
