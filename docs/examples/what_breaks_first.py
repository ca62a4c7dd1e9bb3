"""What breaks an agent first: its own eye, spoilt in one way at a time, on protocol cases.

    python docs/examples/what_breaks_first.py stopping-zone 1

The first table spoils the lens, the air and the target. It tells how many of the cases of R152 and FMVSS 127
are avoided (no contact, and not braked prematurely), and in how many false-reaction cases the agent brakes.
The second one sets dark, asphalt-grey and light targets by day, at night and in fog on three textures of the
asphalt, and tells how many of R152's cases are avoided.
Rates carry Wilson's 95 % interval. The argument after the agent is the number of seeds.
"""

import sys
from collections.abc import Callable, Sequence
from typing import Any

from joblib import Parallel, delayed

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.sensors import DEFAULT_CAMERA, SensorConfig
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.summary import wilson
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task
from lgmd_gym.camera import CameraParams

Lens = dict[str, Any]
Row = dict[str, Any]
Spoil = Callable[[Lens], Lens]


def laid_over(**fields: Any) -> Spoil:
    """Return what lays camera fields over a lens."""
    return lambda lens: {**lens, **fields}


def pitched(degrees: float) -> Spoil:
    """Return what mounts a lens with an error of pitch, upwards [deg]."""
    return lambda lens: {**lens, "pitch_deg": CameraParams.make(lens).pitch_deg + degrees}


# What is spoilt -> what happens to each lens, and arguments of the cases.
SPOILT: dict[str, tuple[Spoil, dict[str, Any]]] = {
    "clear": (laid_over(), {}),
    "night": (laid_over(condition="night"), {}),
    "fog, 120 m": (laid_over(condition="fog"), {}),
    "lens pitched up 0.3°": (pitched(0.3), {}),
    "lens pitched down 0.3°": (pitched(-0.3), {}),
    "vibration 0.01° rms": (laid_over(vibration_deg=0.01), {}),
    "vibration 0.03° rms": (laid_over(vibration_deg=0.03), {}),
    "heave 5 mm rms": (laid_over(heave_m=0.005), {}),
    "brake dive 0.1° per m/s²": (laid_over(dive_deg=0.1), {}),
    "exposure 11 ms": (laid_over(shutter_s=0.011), {}),
    "robust: 0.1° rms and the last four": (laid_over(condition="degraded"), {}),
    "target as grey as asphalt": (laid_over(), {"shade": 104}),
    "the same, a box without shadow": (laid_over(vehicles="box"), {"shade": 104}),
    "dark box (30)": (laid_over(vehicles="box"), {"shade": 30}),
    "light box (220)": (laid_over(vehicles="box"), {"shade": 220}),
}
BLIND = SensorConfig({"name": "wide", "shape": [8, 8]})  # who never brakes need not look
SHADES = {"dark (30)": 30, "asphalt (104)": 104, "light (220)": 220}
AIR = {"day": "clear", "night": "night", "fog": "fog"}
TEXTURES = (0.5, 1.0, 1.6)  # contrast of the asphalt, times the natural one


def play(agent: str, cases: Sequence[Case], seeds: int, spoil: Spoil, jobs: int) -> list[Row]:
    """Return the rows of an agent behind a spoilt eye."""
    eye = SensorConfig().of(make_agent(agent))
    lenses = eye.camera if isinstance(eye.camera, list) else [eye.camera or DEFAULT_CAMERA]
    named = [{"name": lens} if isinstance(lens, str) else dict(lens) for lens in lenses]
    worn = SensorConfig([spoil(lens) for lens in named], eye.params, eye.condition, eye.include_frame)

    def both(case: Case, seed: int) -> Row:
        truth = run_task(Task(NO_BRAKE, case, seed, BLIND)).truth
        return run_task(Task(agent, case, seed, worn, truth)).row

    rows: Any = Parallel(n_jobs=jobs)(delayed(both)(case, seed) for case in cases for seed in range(seeds))
    failed = next((row["error"] for row in rows if row["error"]), None)
    if failed:
        raise RuntimeError(failed)
    return list(rows)


def rate(rows: Sequence[Row], key: str) -> str:
    """Return k/n of what rows say of a key, with its interval in per cent; a dash for no rows."""
    told = [bool(row[key]) for row in rows if row[key] is not None]
    if not told:
        return "–"
    low, high = wilson(sum(told), len(told))
    return f"{sum(told)}/{len(told)} [{100 * low:.0f}–{100 * high:.0f}]"


def with_arguments(cases: Sequence[Case], **arguments: Any) -> list[Case]:
    """Return the cases with further arguments."""
    return [Case(c.name, c.family, (*c.arguments, *arguments.items()), c.fcw_driver) for c in cases]


def first_table(
    agent: str, seeds: int, jobs: int, names: Sequence[str] = tuple(SPOILT), every: int = 1
) -> None:
    """Print what a spoilt lens, air or target costs."""
    threats = [*find_suite("r152").cases, *find_suite("fmvss127").cases][::every]
    quiet = find_suite("false-reaction").cases[::every]
    print("| what | avoided | premature | false braking |\n|---|---|---|---|")
    for name in names:
        spoil, arguments = SPOILT[name]
        rows = play(agent, with_arguments(threats, **arguments), seeds, spoil, jobs)
        # Targets' shades and shapes say nothing of cases without a target in the lane.
        calm = [] if arguments else play(agent, quiet, seeds, spoil, jobs)
        told = (rate(rows, "avoided"), rate(rows, "premature_brake"), rate(calm, "false_activation"))
        print(f"| {name} | {' | '.join(told)} |", flush=True)


def second_table(agent: str, seeds: int, jobs: int, every: int = 1) -> None:
    """Print contacts avoided by shade, light and texture."""
    cases = find_suite("r152").cases[::every]
    print(f"| target, texture | {' | '.join(AIR)} |\n|---|{'---|' * len(AIR)}")
    for name, shade in SHADES.items():
        for texture in TEXTURES:
            spoils = [laid_over(condition=air, texture=texture) for air in AIR.values()]
            shaded = with_arguments(cases, shade=shade)
            told = [rate(play(agent, shaded, seeds, spoil, jobs), "avoided") for spoil in spoils]
            print(f"| {name}, texture {texture:g} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "stopping-zone"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    first_table(chosen, count, jobs=2)
    print()
    second_table(chosen, count, jobs=2)
