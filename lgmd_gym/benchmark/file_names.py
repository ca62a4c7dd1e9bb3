"""Names of the files of cases and episodes in a run folder."""

import json
import re
from hashlib import blake2b

from lgmd_gym.camera import CLEAR

_MAX_BYTES = 220  # file systems allow 255 with the suffix
# These texts stay distinct with "_" for their separators: a case with slashes, and an agent with options.
_CASE = re.compile(r"[^_:,]+")
_AGENT = re.compile(r"[^_/:,]+(:[^_/:,]+(,[^_/:,]+)*)?")


def series_name(key: tuple[str, str, int, str]) -> str:
    """Return the file stem of the time series of a row, given its `key_of`; different for every key."""
    agent, case, seed, condition = key
    usual = _CASE.fullmatch(case) and _AGENT.fullmatch(agent)
    return _stem((case, agent, f"seed{seed}", condition), bool(usual))


def case_name(case: str, condition: str) -> str:
    """Return the file stem of the plot of a case under a condition; different for every pair."""
    return _stem((case, condition), bool(_CASE.fullmatch(case)))


def _stem(parts: tuple[str, ...], usual: bool) -> str:
    """Return the parts as a file name; a digest distinguishes names that are unusual or too long."""
    shown = parts[:-1] if parts[-1] == CLEAR else parts
    stem = re.sub("[/:,]", "_", "__".join(shown))
    encoded = stem.encode(errors="surrogateescape")
    if usual and len(encoded) <= _MAX_BYTES:
        return stem
    digest = blake2b(json.dumps(parts).encode(), digest_size=6).hexdigest()
    return f"{encoded[:_MAX_BYTES].decode(errors='ignore')}-{digest}"
