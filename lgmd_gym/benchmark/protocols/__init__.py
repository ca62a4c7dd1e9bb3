"""Suites of the emergency-braking protocols, one module per document, with the source of every number.

Every module here has a tuple `SUITES`; a new module needs no change elsewhere.
"""

from importlib import import_module
from pkgutil import iter_modules

from lgmd_gym.benchmark.case import Suite


def load_suites() -> dict[str, Suite]:
    """Return the suites of all modules by name, in the order of the modules' names."""
    modules = [import_module(f"{__name__}.{name}") for _, name, _ in sorted(iter_modules(__path__))]
    return {suite.name: suite for module in modules for suite in module.SUITES}
