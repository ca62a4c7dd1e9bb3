"""The scripts in docs/examples and docs/experiments as modules."""

import importlib.util
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"
EXAMPLES, EXPERIMENTS = DOCS / "examples", DOCS / "experiments"


def load(name):
    """Return a script as a new module; scripts may import each other, as in their folder."""
    folder = EXAMPLES if (EXAMPLES / f"{name}.py").exists() else EXPERIMENTS
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
