"""Sphinx configuration; pages and figures are generated from the code before the build."""

import sys
from pathlib import Path

from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))

from lgmd_gym import __version__

project = "lgmd-gym"
project_copyright = "2026, the lgmd-gym authors"
release = __version__
html_theme = "furo"
html_title = f"lgmd-gym {release}"
html_static_path = ["static", "_generated/static"]
html_css_files = ["site.css"]
extensions = ["myst_nb", "math_svg", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_math_renderer = "svg"
included = ("benchmark", "claims", "clips", "environments")  # in other pages
# The last two are left by a first build, for the notebooks.
exclude_patterns = [
    "_build",
    "examples",
    *(f"_generated/{name}.md" for name in included),
    "jupyter_execute",
    ".jupyter_cache",
]
source_suffix = {".md": "myst-nb"}
nb_execution_mode = "cache"  # in _build; a clean checkout executes all notebooks
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # [s] per cell, with compilation
nb_merge_streams = True
suppress_warnings = ["mystnb.unknown_mime_type"]
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings say shapes, units and types
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False


def setup(app: Sphinx) -> None:
    """Generate the pages from the code before the build."""
    import generate

    app.connect("config-inited", lambda app, config: generate.main(Path(app.confdir) / "_generated"))
