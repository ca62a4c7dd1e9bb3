"""The scripts in docs/examples and docs/experiments as modules."""

import importlib.util
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"
EXAMPLES, EXPERIMENTS = DOCS / "examples", DOCS / "experiments"


def load(name):
    """Return a script, such as "bodies" or "realism/realism", as a new module.

    Scripts may import each other, as in their folder.
    """
    path = next(
        folder / f"{name}.py" for folder in (EXAMPLES, EXPERIMENTS) if (folder / f"{name}.py").exists()
    )
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
