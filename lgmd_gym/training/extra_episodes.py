"""Episodes that a policy is trained on in addition: levels of chosen families, traffic of chosen kinds."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from lgmd_gym.envs.families.distribution import EXTRA_FAMILIES, check_families
from lgmd_gym.envs.registration import TRAFFIC_KINDS
from lgmd_gym.errors import check_known, check_whole, shown

LEVELS_EXAMPLE = f"400:{','.join(EXTRA_FAMILIES[:2])}"
TRAFFIC_EXAMPLE = "400:intersection,roundabout"


@dataclass(frozen=True)
class ExtraEpisodes:
    """A number of episodes, and the families of their levels or the kinds of their traffic."""

    count: int
    names: tuple[str, ...]


def parse_levels(text: str) -> ExtraEpisodes:
    """Return the levels of a text such as "400:CCRsCurve,StandingBox".

    Raises:
        ValueError: If the text has another form, for an unknown family, or for one that is named twice.
    """
    count, names = _split("extra_levels", text, LEVELS_EXAMPLE)
    families = check_families(names)
    _check_once("extra_levels", text, "family", families)
    return ExtraEpisodes(count, families)


def parse_traffic(text: str) -> ExtraEpisodes:
    """Return the traffic episodes of a text such as "400:intersection,roundabout".

    Raises:
        ValueError: If the text has another form, for an unknown kind, or for one that is named twice.
    """
    count, kinds = _split("extra_traffic", text, TRAFFIC_EXAMPLE)
    for kind in kinds:
        check_known("kind of traffic", kind, TRAFFIC_KINDS)
    _check_once("extra_traffic", text, "kind", kinds)
    return ExtraEpisodes(count, tuple(kinds))


def _split(option: str, text: str, example: str) -> tuple[int, list[str]]:
    """Return the number and the names of a text "NUMBER:NAME,NAME"."""
    match = re.fullmatch(r"\s*([0-9]{1,9})\s*:(.+)", text)
    if match is None:
        raise ValueError(f"{option} must be like {example!r}, got {shown(text)}")
    count, names = match.groups()
    return check_whole(f"number of {option}", int(count), 1), [name.strip() for name in names.split(",")]


def _check_once(option: str, text: str, noun: str, names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        raise ValueError(f"{option} names a {noun} twice: {shown(text)}; use each name once")
