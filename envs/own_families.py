"""Scenario families of the user, in modules of the user."""

from collections.abc import Iterable
from types import ModuleType

from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.registration import register_envs, register_family
from lgmd_gym.errors import check_text, shown, unknown_name
from lgmd_gym.processes.user_modules import import_user_module


def import_families(modules: Iterable[str]) -> None:
    """Import modules that define scenario families, and register the families and their ids.

    Args:
        modules: "MODULE" for a module that calls `register_family`, or "MODULE:NAME" for a function or class
            in it, which is registered under its name. Modules may be in the working directory.

    Raises:
        ValueError: If a module cannot be imported, or defines no such family.
    """
    for text in modules:
        module_name, _, name = check_text("module", text).partition(":")
        module = import_user_module(module_name, f"module {shown(module_name)}")
        if name:
            _register(module, name)
        elif not _families_of(module_name):
            raise ValueError(
                f"module {module_name!r} registers no scenario family; decorate a function with "
                f"@register_family('NAME'), or pass {module_name}:FUNCTION"
            )
    register_envs()


def is_own(family: str) -> bool:
    """Return whether a registered family is defined outside this package."""
    return not _module_of(family).startswith("lgmd_gym.")


def _register(module: ModuleType, name: str) -> None:
    """Register a function or class of a module under its name, unless it is registered."""
    if name in _families_of(module.__name__):
        return
    function = getattr(module, name, None)
    if function is None:
        known = {*_families_of(module.__name__), *(key for key in vars(module) if not key.startswith("_"))}
        raise unknown_name(f"family of module {module.__name__}", name, known)
    if function not in FAMILIES.values():
        register_family(name)(function)


def _families_of(module: str) -> list[str]:
    """Return the families that are defined in a module or, for a package, below it."""
    return [name for name in FAMILIES if f"{_module_of(name)}.".startswith(f"{module}.")]


def _module_of(family: str) -> str:
    return str(getattr(FAMILIES[family], "__module__", ""))
