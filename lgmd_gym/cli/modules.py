"""The options `--module` and `--trust`: modules with scenario families of the user."""

import sys


def chosen_modules(sources: tuple[str, ...], named: tuple[str, ...] | None, trust: bool) -> tuple[str, ...]:
    """Return the modules that a command imports.

    Args:
        sources: Names of suites and paths of files.
        named: Modules of `--module`.
        trust: Whether to add those that the files name; each is printed to stderr.
    """
    from lgmd_gym.benchmark.suite_file import declared_modules

    modules = list(named or ())
    for source in sources if trust else ():
        for module in declared_modules(source):
            if module not in modules:
                print(f"lgmd-gym: loading module {module!r}, named in {source!r}", file=sys.stderr)
                modules.append(module)
    return tuple(modules)
