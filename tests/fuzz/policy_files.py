"""Damaged policy files: `python tests/fuzz/policy_files.py --seconds 60`.

A case is the shipped policy with bytes changed or cut off, or with a value of its card changed. Loading must
succeed, or raise a ValueError of one line.
"""

import json
import sys
import tempfile
import zipfile
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from support.fuzz import run_cases

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import CARD
from lgmd_gym.agents.policies.policy import SHIPPED

SOURCE = SHIPPED / "all-round.zip"
VALUES = (None, True, -1, 0, 7, 1e400, "", "ppo", "nix", [], [None], [2.0], ["zones"], {}, {"a": 1})


def with_card(path, change):
    """Write the policy with a changed card."""
    with zipfile.ZipFile(SOURCE) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            target.writestr(name, change(json.loads(data)) if name == CARD else data)


def change_value(rng, card):
    """Replace or delete a random value of a card, and return the card as text."""
    place = card
    while True:
        key = rng.choice(list(place)) if isinstance(place, dict) else int(rng.integers(len(place)))
        inner = place[key]
        if not isinstance(inner, dict | list) or not inner or rng.random() < 0.3:
            break
        place = inner
    if rng.random() < 0.2:
        del place[key]
    else:
        place[key] = VALUES[rng.integers(len(VALUES))]
    return json.dumps(card)


def damage(rng, path):
    """Write a damaged file, and return what was done."""
    data, kind = bytearray(SOURCE.read_bytes()), rng.integers(4)
    if kind == 0:
        with_card(path, lambda card: change_value(rng, card))
        return "card changed"
    if kind == 1:
        with_card(path, lambda card: json.dumps(card)[: rng.integers(100)])
        return "card cut off"
    if kind == 2:
        length = int(rng.integers(len(data)))
        path.write_bytes(data[:length])
        return f"cut off after {length} bytes"
    places = rng.integers(len(data), size=rng.integers(1, 40))
    for place in places:
        data[place] = rng.integers(256)
    path.write_bytes(data)
    return f"{len(places)} bytes changed"


def draw_case(rng):
    """Return a description and the check of one damaged file."""

    def check():
        message = ""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "policy.zip"
            damage(rng, path)
            try:
                make_agent(f"policy:{path}")
            except ValueError as error:
                message = str(error)
        assert "\n" not in message, message

    return "a damaged policy file", check


if __name__ == "__main__":
    sys.exit(run_cases(draw_case, __doc__))
