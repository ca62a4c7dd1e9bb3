"""Write the results of `lgmd-gym neurons compare` into the page "Which neuron?".

The text before the marker on the page is kept; the sections of the report replace what follows it, and the
figures are copied beside the page.

    python docs/experiments/which_neuron.py RUN
"""

import re
import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
MARKER = "<!-- The sections below are written by docs/experiments/which_neuron.py. -->"


def main(run: Path, page: Path = DOCS / "which_neuron.md") -> None:
    """Update the page and its figures from a run folder."""
    report = (run / "report.md").read_text(encoding="utf-8")
    sections = report[report.index("\n## ") :]
    figures = re.findall(r"!\[[^\]]*\]\(([\w.]+)\)", sections)
    folder = page.with_suffix("")
    folder.mkdir(exist_ok=True)
    for name in figures:
        shutil.copy(run / name, folder / name)
        sections = sections.replace(f"]({name})", f"]({folder.name}/{name})")
    head = page.read_text(encoding="utf-8").partition(MARKER)[0]
    page.write_text(f"{head}{MARKER}\n{sections}", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
