"""Values of options: types with a readable placeholder; reading of files, worlds and modules."""

import sys
import time
from collections.abc import Collection, Iterable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from tyro.conf import arg

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.errors import check_keys

if TYPE_CHECKING:
    from lgmd_gym.agents import Agent
    from lgmd_gym.benchmark.case import Case
    from lgmd_gym.sensing.channel import ChannelSpec

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


def read_camera(text: str | None) -> "ChannelSpec | None":
    """Return a preset's name as it is, the cameras of a TOML file, or None for none.

    Args:
        text: Name of a preset, or path of a file (.toml) with the fields of a camera or channel; several are
            [[camera]] tables.

    Raises:
        ValueError: If the file cannot be read, or contains an unknown field or a value out of range.
    """
    from lgmd_gym.benchmark.case_table import read_data
    from lgmd_gym.sensing.channel import make_channels

    if text is None or not text.endswith(".toml"):
        return text
    path = Path(text)
    values = {"name": path.stem} | read_data(path, "camera file")
    tables: object = values.get("camera")
    several = isinstance(tables, list)
    try:
        if several:
            check_keys("key of a file with [[camera]] tables", values, ("name", "camera"))
        given = cast("ChannelSpec", tables if several else values)
        make_channels(given)
    except (TypeError, ValueError) as error:
        raise ValueError(f"camera file {text!r}: {error}") from None
    return given


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


def split_pairs(pairs: tuple[str, ...]) -> dict[str, str]:
    """Return NAME=VALUE pairs as a dict of texts.

    Raises:
        ValueError: For a pair without a name or a value.
    """
    texts: dict[str, str] = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        if not name or not value:
            raise ValueError(f"--set must be NAME=VALUE, for example ego_speed=8.3, got {pair!r}")
        texts[name] = value
    return texts


def parse_arguments(pairs: tuple[str, ...]) -> Arguments:
    """Return NAME=VALUE pairs as a dict: numbers, `true` and `false` as flags, else texts.

    Raises:
        ValueError: For a pair without a name or a value.
    """
    return {
        name: {"true": True, "false": False}.get(value, _number_or_text(name, value))
        for name, value in split_pairs(pairs).items()
    }


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


def find_target(
    target: str, case: str | None, named: tuple[str, ...] | None, trust: bool, pairs: tuple[str, ...] = ()
) -> "tuple[str | Case, Arguments]":
    """Return the case of a file, or another target as it is, and the arguments of its environment.

    Args:
        target: Target of a command, such as the path of a file or an environment id.
        case: Name of a case of the file; None if it has only one.
        named: See `chosen_modules`.
        trust: See `chosen_modules`.
        pairs: NAME=VALUE pairs of `--set`; in an OpenSCENARIO file, names other than those of the appearance
            are its parameters.

    Raises:
        ValueError: See `find_own_case` and `parse_arguments`; or for a name of a case although the target is
            no file.
    """
    from lgmd_gym.benchmark.suites import OPENSCENARIO, find_own_case, is_file
    from lgmd_gym.envs import import_families
    from lgmd_gym.envs.registration import APPEARANCE

    modules, arguments = chosen_modules((target,), named, trust), parse_arguments(pairs)
    if target.endswith(OPENSCENARIO):
        parameters = {name: text for name, text in split_pairs(pairs).items() if name not in APPEARANCE}
        chosen = {name: value for name, value in arguments.items() if name in APPEARANCE}
        return find_own_case(target, case, modules, parameters), chosen
    if is_file(target):
        return find_own_case(target, case, modules), arguments
    if case is not None:
        raise ValueError(f"--case {case!r} needs a file with several cases, got {target!r}; remove it")
    import_families(modules)
    return target, arguments
