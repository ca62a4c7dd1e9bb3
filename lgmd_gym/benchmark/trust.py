"""Code from outside this package: it is loaded only if a person has named or trusted it."""

import sys
from collections.abc import Iterable
from pathlib import Path

from lgmd_gym.agents.registry import outside_code


def check_trust(agents: Iterable[str], source: Path, trust: bool) -> None:
    """Print the modules and policy files that agents load, one line each to stderr.

    Args:
        agents: Agent strings.
        source: File that names the agents.
        trust: Whether the user trusts this file.

    Raises:
        ValueError: If the user does not trust the file and an agent loads code from outside this package.
    """
    for agent in agents:
        code = outside_code(agent)
        if code is None:
            continue
        if not trust:
            raise ValueError(
                f"{str(source)!r} names agent {agent!r}, which runs the code of {code}; if you trust it, "
                "add --trust"
            )
        print(f"lgmd-gym: loading {code}, named in {str(source)!r}", file=sys.stderr)


def check_named(declared: Iterable[str], named: Iterable[str], source: Path) -> None:
    """Check that the user has named the modules with scenario families that a file declares.

    Args:
        declared: "MODULE" or "MODULE:NAME" in the file.
        named: Those that the user has named.
        source: The file.

    Raises:
        ValueError: If the user has not named one.
    """
    known = {text.partition(":")[0] for text in named}
    for text in declared:
        module = text.partition(":")[0]
        if module not in known:
            raise ValueError(
                f"{str(source)!r} names module {module!r}, whose code would run; if you trust it, add "
                f"--module {module} or --trust (in Python, modules=[{module!r}])"
            )
