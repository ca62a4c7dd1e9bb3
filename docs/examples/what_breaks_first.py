"""Robustness of an agent: protocol cases with one change of camera, weather or target at a time.

    python docs/examples/what_breaks_first.py stopping-zone 1

The first table changes the camera, the weather or the target. It lists how many cases of R152 and FMVSS 127
are avoided (no contact and no premature braking), and the false activations in the false-reaction cases.
The second table combines dark, asphalt-grey and light targets with day, night and fog and three asphalt
textures, and lists how many cases of R152 are avoided.
Rates have a 95 % interval that clusters by case and world. The second argument is the number of seeds.
"""

import sys
from collections.abc import Callable, Sequence
from typing import Any

from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.sensors import DEFAULT_CAMERA, SensorConfig
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.summary import Sample, rate_of
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task
from lgmd_gym.camera import CameraParams

Camera = dict[str, Any]
Row = dict[str, Any]
Change = Callable[[Camera], Camera]


def with_fields(**fields: Any) -> Change:
    """Return a function that replaces camera fields."""
    return lambda camera: {**camera, **fields}


def pitched(degrees: float) -> Change:
    """Return a function that adds a mounting error in pitch, positive upwards [deg]."""
    return lambda camera: {**camera, "pitch_deg": CameraParams.make(camera).pitch_deg + degrees}


# Name -> change of each camera, and arguments of the cases.
CHANGES: dict[str, tuple[Change, dict[str, Any]]] = {
    "clear": (with_fields(), {}),
    "night": (with_fields(condition="night"), {}),
    "fog, 120 m": (with_fields(condition="fog"), {}),
    "camera pitched up 0.3°": (pitched(0.3), {}),
    "camera pitched down 0.3°": (pitched(-0.3), {}),
    "smooth road": (with_fields(), {"road": "smooth"}),
    "normal road": (with_fields(), {"road": "normal"}),
    "brake dive 0.1° per m/s²": (with_fields(dive_deg=0.1), {}),
    "exposure 11 ms": (with_fields(shutter_s=0.011), {}),
    "rain": (with_fields(condition="rain"), {}),
    "target as grey as asphalt": (with_fields(), {"shade": 104}),
    "the same, a box without shadow": (with_fields(vehicles="box"), {"shade": 104}),
    "dark box (30)": (with_fields(vehicles="box"), {"shade": 30}),
    "light box (220)": (with_fields(vehicles="box"), {"shade": 220}),
}
NO_VIEW = SensorConfig({"name": "wide", "shape": [8, 8]})  # no-brake needs no useful image
SHADES = {"dark (30)": 30, "asphalt (104)": 104, "light (220)": 220}
AIR = {"day": "clear", "night": "night", "fog": "fog"}
TEXTURES = (0.5, 1.0, 1.6)  # contrast of the asphalt, relative to the default


def play(agent: str, cases: Sequence[Case], seeds: int, change: Change, jobs: int) -> list[Row]:
    """Return the rows of an agent with changed cameras."""
    own = SensorConfig().for_agent(make_agent(agent))
    cameras = own.camera if isinstance(own.camera, list) else [own.camera or DEFAULT_CAMERA]
    named = [{"name": item} if isinstance(item, str) else dict(item) for item in cameras]
    changed = SensorConfig([change(item) for item in named], own.params, own.condition, own.include_frame)

    def both(case: Case, seed: int) -> Row:
        truth = run_task(Task(NO_BRAKE, case, seed, NO_VIEW)).counterfactual
        return run_task(Task(agent, case, seed, changed, truth)).row

    rows: Any = Parallel(n_jobs=jobs)(delayed(both)(case, seed) for case in cases for seed in range(seeds))
    failed = next((row["error"] for row in rows if row["error"]), None)
    if failed:
        raise RuntimeError(failed)
    return list(rows)


def rate(rows: Sequence[Row], key: str) -> str:
    """Return k/n of a boolean row key with its interval in per cent; a dash without rows."""
    return rate_text(rate_of([row for row in rows if row[key] is not None], key))


def with_arguments(cases: Sequence[Case], **arguments: Any) -> list[Case]:
    """Return the cases with additional arguments."""
    return [Case(c.name, c.family, (*c.arguments, *arguments.items()), c.fcw_driver) for c in cases]


def first_table(
    agent: str, seeds: int, jobs: int, names: Sequence[str] = tuple(CHANGES), every: int = 1
) -> None:
    """Print the table of changed cameras, weather and targets."""
    threats = [*find_suite("r152").cases, *find_suite("fmvss127").cases][::every]
    non_threats = find_suite("false-reaction").cases[::every]
    print("| change | avoided | premature | false activations | sample |\n|---|---|---|---|---|")
    for name in names:
        change, arguments = CHANGES[name]
        rows = play(agent, with_arguments(threats, **arguments), seeds, change, jobs)
        # Shades and shapes of targets do not apply to cases without a target in the lane.
        false_reaction = [] if arguments else play(agent, non_threats, seeds, change, jobs)
        cells = (
            rate(rows, "avoided"),
            rate(rows, "premature_brake"),
            rate(false_reaction, "false_activation"),
        )
        sample = f"{Sample.of(rows)}, {Sample.of(false_reaction)}" if false_reaction else str(Sample.of(rows))
        print(f"| {name} | {' | '.join(cells)} | {sample} |", flush=True)


def second_table(agent: str, seeds: int, jobs: int, every: int = 1) -> None:
    """Print avoided contacts by target shade, light and asphalt texture."""
    cases = find_suite("r152").cases[::every]
    sample = Sample.of({"case": case.name} for case in cases)
    print(f"| target, texture: {sample} | {' | '.join(AIR)} |\n|---|{'---|' * len(AIR)}")
    for name, shade in SHADES.items():
        for texture in TEXTURES:
            changes = [with_fields(condition=air, texture=texture) for air in AIR.values()]
            shaded = with_arguments(cases, shade=shade)
            cells = [rate(play(agent, shaded, seeds, change, jobs), "avoided") for change in changes]
            print(f"| {name}, texture {texture:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "stopping-zone"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    first_table(chosen, count, jobs=2)
    print()
    second_table(chosen, count, jobs=2)
