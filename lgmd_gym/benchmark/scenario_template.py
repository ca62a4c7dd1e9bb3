"""A commented scenario file to start from."""

from pathlib import Path

from lgmd_gym.errors import check_path
from lgmd_gym.processes.files import check_output_file, complete_file

TEMPLATE = """\
# A scenario of lgmd-gym. Units: m, m/s, s, rad; 70 km/h is 19.44 m/s, 50 km/h is 13.89 m/s.
#   lgmd-gym scenario show FILE      draw it
#   lgmd-gym drive FILE              run one episode
#   lgmd-gym bench --suite FILE      run agents on it
# For sweeps, write a suite file with [[cases]] tables.

# name = "close"                     # last part of the case's name; without it the speed, as in "v70"

# Either a family with arguments (lgmd-gym list envs):
# family = "CutIn"
# arguments = { ego_speed = 19.44, gap = 8.0, excess = -5.56 }

# or the ego's script and all actors:
family = "own"                       # any name

[scenario]
ego_speed = 19.44
duration = 12.0                      # the episode ends earlier at contact or standstill
# ego_profile = [{ start = 2.0, acceleration = -1.0, final_speed = 15.0 }]
# ego_path = [{ length = 50.0 }, { length = 30.0, curvature = 0.01 }]
# road = { kind = "straight", lanes = 3, ego_lane = 1 }     # or "two-way", "curve", "crossing"

[[scenario.actors]]                  # the first actor is the target of the benchmark's rows
gap = 30.0                           # from the ego's front bumper to the actor's rear
lateral_offset = 3.5                 # centre to centre, + left; a lane is 3.5 m wide
speed = 13.89
# A lane change to the right, 44 m long, after 50 m straight ahead; curvature in 1/m, + left:
path = [
    { length = 50.0 },
    { length = 11.0, end_curvature = -0.0145 },
    { length = 11.0, curvature = -0.0145, end_curvature = 0.0 },
    { length = 11.0, end_curvature = 0.0145 },
    { length = 11.0, curvature = 0.0145, end_curvature = 0.0 },
]
# heading = 0.0                      # relative to the ego's, + left
# shade = 40                         # grey level in [0, 255]; without it drawn from the seed

[[scenario.actors]]
gap = 60.0
speed = 19.44
length = 12.0                        # a truck; the default is a car of 4.023 x 1.712 x 1.427 m
width = 2.5
height = 3.5
# kind = "car"                       # or "box", "road_marking", "pedestrian", "bicycle", "motorcycle"
profile = [{ start = 4.0, acceleration = -3.0, final_speed = 8.0 }]     # build_up = 0.5: a ramp
"""


def write_template(path: Path | str, force: bool = False) -> Path:
    """Write the template of a scenario file; return its path.

    Args:
        path: File to write (".toml").
        force: Whether to replace an existing file.

    Raises:
        ValueError: If the file exists or cannot be created, or its name does not end in ".toml".
    """
    path = check_path("path", path)
    if path.suffix != ".toml":
        raise ValueError(f"a scenario template must have the suffix .toml, got {path.name!r}")
    check_output_file(path, "scenario file", force)
    with complete_file(path) as part:
        part.write_text(TEMPLATE, encoding="utf-8")
    return path
