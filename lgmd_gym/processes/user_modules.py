"""Import of modules of the user."""

import os
import sys
from importlib import import_module
from types import ModuleType


def import_user_module(name: str, kind: str) -> ModuleType:
    """Return a module of the user, which may be in the working directory.

    Args:
        name: Name of the module, as in an import statement.
        kind: What it is, for the message.

    Raises:
        ValueError: If it cannot be imported, or its code raises an exception.
    """
    if name.endswith(".py"):
        raise ValueError(f"{kind} cannot be imported; write the name of its module without .py")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        found = error.name is None or not f"{name}.".startswith(f"{error.name}.")
        place = "" if found else "; run the command in the folder of the module"
        raise ValueError(f"{kind} cannot be imported ({error}){place}") from None
    except Exception as error:  # of the module's own code
        raise ValueError(f"{kind} cannot be imported ({error_reason(error)})") from error


def error_reason(error: Exception) -> str:
    """Return the message of an error, and where it occurred unless the message states that."""
    text = f"{error}" if isinstance(error, ImportError) else f"{type(error).__name__}: {error}"
    if isinstance(error, ImportError | SyntaxError) or error.__traceback__ is None:
        return text
    trace = error.__traceback__
    while trace.tb_next is not None:
        trace = trace.tb_next
    return f"{text}, {os.path.basename(trace.tb_frame.f_code.co_filename)} line {trace.tb_lineno}"
