"""`ExtraLevels`: levels of chosen families that a policy is trained on in addition to the usual ones."""

import re
from dataclasses import dataclass

from lgmd_gym.envs.scenarios.distribution import EXTRA_FAMILIES, check_families
from lgmd_gym.errors import check_whole, shown

EXAMPLE = f"400:{','.join(EXTRA_FAMILIES[:2])}"


@dataclass(frozen=True)
class ExtraLevels:
    """A number of levels and the scenario families that they are drawn from."""

    count: int
    families: tuple[str, ...]

    @classmethod
    def parse(cls, text: str) -> "ExtraLevels":
        """Return the levels of a text such as "400:CCRsCurve,StandingBox".

        Raises:
            ValueError: If the text has another form, or for an unknown family.
        """
        match = re.fullmatch(r"\s*([0-9]{1,9})\s*:(.+)", text)
        if match is None:
            raise ValueError(f"extra_levels must be like {EXAMPLE!r}, got {shown(text)}")
        count, names = match.groups()
        families = check_families([name.strip() for name in names.split(",")])
        if len(set(families)) < len(families):
            raise ValueError(f"extra_levels names a family twice: {shown(text)}; use each name once")
        return cls(check_whole("number of extra_levels", int(count), 1), families)
