"""The options `--case`, `--module` and `--trust`: cases of files, and scenario families of the user."""

import sys

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suite_file import declared_modules, find_own_case, is_file
from lgmd_gym.envs import import_families


def chosen_modules(sources: tuple[str, ...], named: tuple[str, ...] | None, trust: bool) -> tuple[str, ...]:
    """Return the modules that a command imports.

    Args:
        sources: Names of suites and paths of files.
        named: Modules of `--module`.
        trust: Whether to add those that the files name; each is printed to stderr.
    """
    modules = list(named or ())
    for source in sources if trust else ():
        for module in declared_modules(source):
            if module not in modules:
                print(f"lgmd-gym: loading module {module!r}, named in {source!r}", file=sys.stderr)
                modules.append(module)
    return tuple(modules)


def find_target(target: str, case: str | None, named: tuple[str, ...] | None, trust: bool) -> str | Case:
    """Return the case of a file, or another target as it is.

    Args:
        target: Target of a command, such as the path of a file or an environment id.
        case: Name of a case of the file; None if it has only one.
        named: See `chosen_modules`.
        trust: See `chosen_modules`.

    Raises:
        ValueError: See `find_own_case`; or for a name of a case although the target is no file.
    """
    modules = chosen_modules((target,), named, trust)
    if is_file(target):
        return find_own_case(target, case, modules)
    if case is not None:
        raise ValueError(f"--case {case!r} needs a file with several cases, got {target!r}; remove it")
    import_families(modules)
    return target
