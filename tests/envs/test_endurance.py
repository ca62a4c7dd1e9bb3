"""The command that measures memory, files and threads over many steps."""

import subprocess
import sys
from pathlib import Path

import pytest
from fuzz.endurance import Usage, findings


def test_growth_after_the_first_quarter_is_found():
    start, settled = Usage(100.0, 100.0, 5, 1), Usage(200.0, 200.0, 6, 2)
    assert findings([start, *[settled] * 4]) == []
    assert findings([start, *[settled] * 3, settled._replace(resident=210.0)]) == []
    grown = Usage(211.0, 211.0, 7, 3)
    assert findings([start, *[settled] * 3, grown]) == [
        "files grew from 6 to 7",
        "threads grew from 2 to 3",
        "memory grew by 11.0 MiB",
    ]


@pytest.mark.slow
def test_two_thousand_steps_of_a_single_environment_leave_nothing():
    program = Path(__file__).parents[1] / "fuzz" / "endurance.py"
    command = [sys.executable, str(program), "braking", "--steps", "2000"]
    assert subprocess.run(command, capture_output=True, text=True).stdout.endswith("nothing has grown\n")
