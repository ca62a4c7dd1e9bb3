"""Cases of the Euro NCAP suites by family, also beside the cells of OpenSCENARIO files.

    python docs/experiments/protocol_counts.py [FOLDER]

FOLDER contains the Euro NCAP scenarios of Vector Informatik, `OSC-NCAP-scenarios/OpenSCENARIO/NCAP`. The
files that vary all parameters of a test are counted, not those of single cells. Without it, the table has the
cases of the suites alone. It is in Markdown.
"""

import re
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.openscenario import read

FILES = {
    "ncap2023": "AEB_C2C_2023/Variations/*Variation*.xosc",
    "ncap2023-vru": "AEB_VRU_2023/Variations/*Variation*.xosc",
    "ncap2026": "CA-FC_2026/Variations/StandardRange/*.xosc",
    "ncap2026-extended": "CA-FC_2026/Variations/ExtendedRange/*.xosc",
}


def counts(cases: Iterable[Case]) -> Counter[str]:
    """Return the number of cases by family; those with an FCW driver apart.

    The files name locations and turns with the family, such as CPNA-25, CPRA_Cm and CPTAfs.
    """
    return Counter(
        "".join(re.findall(r"^(?:CPTA|[A-Za-z]+)", case.family)) + (" warned" if case.fcw_driver else "")
        for case in cases
    )


def case_table() -> list[str]:
    """Return the lines of the table without cells of files."""
    columns = {suite: counts(SUITES[suite].cases) for suite in FILES}
    families = sorted({family for counter in columns.values() for family in counter})
    heads = " | ".join(f"`{suite}`" for suite in columns)
    lines = [f"| family | {heads} |", f"|---|{'---:|' * len(columns)}"]
    for family in families:
        lines.append(f"| {family} | {' | '.join(str(item[family] or '') for item in columns.values())} |")
    return [*lines, f"| **all** | {' | '.join(str(item.total()) for item in columns.values())} |"]


def table(folder: Path) -> list[str]:
    """Return the lines of the table: cases of the suite / cells of the files."""
    columns: dict[str, tuple[Counter[str], Counter[str]]] = {}
    for suite, pattern in FILES.items():
        paths = sorted(folder.glob(pattern))
        if not paths:
            raise ValueError(f"no file {pattern} in {str(folder)!r}; pass the folder NCAP of the scenarios")
        cells = counts(case for path in paths for case in read(path).cases)
        columns[suite] = counts(SUITES[suite].cases), cells
    families = sorted({family for pair in columns.values() for counter in pair for family in counter})
    lines = [f"| family | {' | '.join(columns)} |", "| --- " * (len(columns) + 1) + "|"]
    for family in families:
        texts = [f"{a[family]} / {b[family]}" if a[family] or b[family] else "" for a, b in columns.values()]
        lines.append(f"| {family} | {' | '.join(texts)} |")
    totals = " | ".join(f"{a.total()} / {b.total()}" for a, b in columns.values())
    return [*lines, f"| all | {totals} |"]


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    try:
        print(*(table(Path(sys.argv[1])) if len(sys.argv) > 1 else case_table()), sep="\n")
    except ValueError as error:
        sys.exit(str(error))
