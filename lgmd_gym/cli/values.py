"""Values of options: types with a readable placeholder; reading of files, worlds and modules."""

import sys
import time
from collections.abc import Collection, Iterable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg

from lgmd_gym.aliases import Arguments, Values

if TYPE_CHECKING:
    from lgmd_gym.agents import Agent
    from lgmd_gym.benchmark.case import Case

Name = Annotated[str | None, arg(metavar="NAME")]
Names = Annotated[tuple[str, ...] | None, arg(metavar="NAME [NAME ...]")]
Count = Annotated[int | None, arg(metavar="N")]
Number = Annotated[float | None, arg(metavar="X")]
File = Annotated[Path | None, arg(metavar="PATH")]


def refuse_unused(options: Any, used: Collection[str]) -> None:
    """Raise ValueError for options that differ from their defaults and have no effect beside --resume."""
    given = [
        f"--{item.name.replace('_', '-')}"
        for item in fields(options)
        if item.name not in used and getattr(options, item.name) != item.default
    ]
    if given:
        raise ValueError(f"--resume uses the settings of its run and ignores {', '.join(given)}; remove them")


def read_params(path: Path | None) -> Values | None:
    """Return the LGMD parameters in a TOML file as plain values, or None for no file.

    Raises:
        ValueError: If the file cannot be read or holds an unknown parameter.
    """
    from lgmd_gym.neuron import LGMDParams

    if path is None:
        return None
    try:
        return LGMDParams.from_toml(path).to_dict()
    except OSError as error:
        raise ValueError(f"params file {str(path)!r} cannot be read: {error.strerror}") from None


def note_unused_params(path: Path | None, agents: "Iterable[Agent]") -> None:
    """Print a line to stderr for agents whose braking the parameters do not change."""
    names = [agent.name for agent in agents if not agent.reads_neuron]
    if path is not None and names:
        print(
            f"lgmd-gym: --params {path} does not change the braking of {', '.join(names)}, which does not "
            "depend on the neuron",
            file=sys.stderr,
        )


def default_out(out: Path | None, name: str) -> Path:
    """Return the folder of --out, or one in `runs` with a name and the time, to the millisecond."""
    if out is not None:
        return out
    now = time.time_ns()
    text = time.strftime("%Y%m%d-%H%M%S", time.localtime(now // 10**9))
    return Path("runs") / f"{name}-{text}-{now // 10**6 % 1000:03d}"


def parse_arguments(pairs: tuple[str, ...]) -> Arguments:
    """Return NAME=VALUE pairs as a dict: numbers, `true` and `false` as flags, else texts.

    Raises:
        ValueError: For a pair without a name or a value.
    """
    arguments: Arguments = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        if not name or not value:
            raise ValueError(f"--set must be NAME=VALUE, for example ego_speed=8.3, got {pair!r}")
        arguments[name] = {"true": True, "false": False}.get(value, _number_or_text(name, value))
    return arguments


def _number_or_text(name: str, value: str) -> float | str:
    try:
        return int(value) if name == "shade" else float(value)
    except ValueError:
        return value


def parse_world(text: str | None) -> Values:
    """Return the argument `world` of an environment, or {} for None.

    Raises:
        ValueError: If there is no such world.
    """
    from lgmd_gym.camera.worlds import LABORATORY, check_world

    if text is None:
        return {}
    world = check_world(int(text) if text.lstrip("-").isdecimal() else text)
    return {"world": LABORATORY if world is None else world}


def chosen_modules(sources: tuple[str, ...], named: tuple[str, ...] | None, trust: bool) -> tuple[str, ...]:
    """Return the modules that a command imports.

    Args:
        sources: Names of suites and paths of files.
        named: Modules of `--module`.
        trust: Whether to add those that the files name; each is printed to stderr.
    """
    from lgmd_gym.benchmark.suites import declared_modules

    modules = list(named or ())
    for source in sources if trust else ():
        for module in declared_modules(source):
            if module not in modules:
                print(f"lgmd-gym: loading module {module!r}, named in {source!r}", file=sys.stderr)
                modules.append(module)
    return tuple(modules)


def find_target(target: str, case: str | None, named: tuple[str, ...] | None, trust: bool) -> "str | Case":
    """Return the case of a file, or another target as it is.

    Args:
        target: Target of a command, such as the path of a file or an environment id.
        case: Name of a case of the file; None if it has only one.
        named: See `chosen_modules`.
        trust: See `chosen_modules`.

    Raises:
        ValueError: See `find_own_case`; or for a name of a case although the target is no file.
    """
    from lgmd_gym.benchmark.suites import find_own_case, is_file
    from lgmd_gym.envs import import_families

    modules = chosen_modules((target,), named, trust)
    if is_file(target):
        return find_own_case(target, case, modules)
    if case is not None:
        raise ValueError(f"--case {case!r} needs a file with several cases, got {target!r}; remove it")
    import_families(modules)
    return target
