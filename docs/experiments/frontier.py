"""What a camera sees of the target at the last time at which full braking avoids the contact, by family.

    python docs/experiments/frontier.py --suites ncap2026 --to frontier.png

Prints a table in Markdown, medians over the cases of a family, and draws its figure. Angles do not depend on
the camera; pixels, contrast and visibility are those of `--camera`. A target is inside a camera if its centre
is within the field of view.
"""

import argparse
from collections.abc import Callable, Iterable
from math import atan2, cos, degrees, hypot, pi, sin
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.camera import PRESETS, Camera, EgoCamera
from lgmd_gym.envs import BrakingEnv
from lgmd_gym.plotting.style import saved_figure

HOLD, BRAKE = np.zeros(1, np.float32), -np.ones(1, np.float32)
CHANGED = 4.0  # grey levels by which the target must change a pixel that counts
VISIBLE_PX = 4  # changed pixels from which the target counts as visible


class TargetView(NamedTuple):
    """The target in the frame of one decision.

    Attributes:
        distance: Distance of the target's centre from the lens [m].
        bearing_deg: Bearing of the target's centre from the optical axis, + to the right [degrees].
        width_deg: Angle between the target's outermost corners [degrees].
        pixels: Number of pixels that the target changes by at least 4 grey levels.
        contrast: Mean change of these pixels [grey levels]; 0 without any.
    """

    distance: float
    bearing_deg: float
    width_deg: float
    pixels: int
    contrast: float


class Frontier(NamedTuple):
    """The last decision of a case at which full braking avoids the contact.

    Attributes:
        case: Name of the case.
        family: Scenario family.
        avoidable: Whether full braking avoids the contact. If not, the other values are for the last decision
            at which it stops the ego before the contact, or for the first decision if there is none.
        time_left: Time from that decision to the contact of `no-brake` [s].
        view: TargetView at that decision.
        growth_deg_s: Rate of change of the target's angular width over the last frame [degrees/s].
        drift_deg_s: Rate of change of its bearing [degrees/s].
        seen_s: Time since the target became visible for good [s]; 0 if it is not visible yet.
    """

    case: str
    family: str
    avoidable: bool
    time_left: float
    view: TargetView
    growth_deg_s: float
    drift_deg_s: float
    seen_s: float

    def growth_px(self, camera: Camera, fps: float = 30.0) -> float:
        """Return the growth of the target's width per frame in the middle of a camera's image [px]."""
        return self.growth_deg_s / fps * camera.pixels_per_degree


def frontier(case: Case, camera: str | Camera = "wide", seed: int = 0) -> Frontier | None:
    """Return the frontier of a case in the laboratory; None for a case without contact.

    Args:
        case: The case.
        camera: Camera whose frames give visibility and contrast; its optics do not change the angles.
        seed: Seed of the environment, which draws grey levels and the start on the road.
    """
    env = BrakingEnv(case.scenario)
    rate = env.config["policy_frequency"]
    contact = _decisions_until_end(env, seed)
    if contact is None:
        return None
    avoided = _last(contact, lambda start: not _brake_from(env, seed, start)["collision"])
    stopped = avoided or _last(contact, lambda start: _brake_from(env, seed, start)["impact_speed"] == 0.0)
    last = stopped or 1
    weather = case.argument("weather", "clear")
    views = _views(env, seed, last, EgoCamera(camera, {"weather": weather}))
    hidden = [number for number, view in enumerate(views) if view.pixels < VISIBLE_PX]
    here, before = views[-1], views[-2]
    return Frontier(
        case.name,
        case.family,
        avoided is not None,
        (contact - last) / rate,
        here,
        (here.width_deg - before.width_deg) * rate,
        (here.bearing_deg - before.bearing_deg) * rate,
        max(last - 1 - hidden[-1], 0) / rate if hidden else last / rate,
    )


def _decisions_until_end(env: BrakingEnv, seed: int) -> int | None:
    """Return the number of decisions up to the contact without braking; None without a contact."""
    env.reset(seed=seed)
    count, ended, info = 0, False, {}
    while not ended:
        _, _, terminated, truncated, info = env.step(HOLD)
        count, ended = count + 1, terminated or truncated
    return count if info["collision"] else None


def _brake_from(env: BrakingEnv, seed: int, start: int) -> dict[str, Any]:
    """Return the last info of an episode with full braking from a decision on."""
    env.reset(seed=seed)
    count, ended, info = 0, False, {}
    while not ended:
        _, _, terminated, truncated, info = env.step(BRAKE if count >= start else HOLD)
        count, ended = count + 1, terminated or truncated
    return info


def _last(contact: int, holds: Callable[[int], bool]) -> int | None:
    """Return the last decision from 1 on for which a condition holds, by bisection; None if never.

    Args:
        contact: Number of decisions up to the contact.
        holds: The condition, true up to a decision and false after it.
    """
    if not holds(1):
        return None
    low, high = 1, contact
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _views(env: BrakingEnv, seed: int, last: int, camera: EgoCamera) -> list[TargetView]:
    """Return the views from the start to a decision without braking."""
    env.reset(seed=seed)
    views = [_view(env, camera)]
    for _ in range(last):
        env.step(HOLD)
        views.append(_view(env, camera))
    return views


def _view(env: BrakingEnv, camera: EgoCamera) -> TargetView:
    """Return the view of the present state."""
    road, ego = env.road, env.ego
    target = road.items[int(env.simulation.state.episodes["target"][0])]
    ahead = ego.LENGTH / 2 - camera.camera.mount.setback_m
    x, y = ego.position[0] + ahead * cos(ego.heading), ego.position[1] + ahead * sin(ego.heading)

    def bearing(point_x: float, point_y: float) -> float:
        angle = atan2(point_y - y, point_x - x) - ego.heading
        return (angle + pi) % (2.0 * pi) - pi

    c, s = cos(target.heading), sin(target.heading)
    corners = [
        bearing(
            target.position[0] + i * target.LENGTH / 2 * c - j * target.WIDTH / 2 * s,
            target.position[1] + i * target.LENGTH / 2 * s + j * target.WIDTH / 2 * c,
        )
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    change = _change(env, camera, target)
    counted = change[change >= CHANGED]
    return TargetView(
        hypot(target.position[0] - x, target.position[1] - y),
        degrees(bearing(*target.position)),
        degrees(max(corners) - min(corners)),
        int(counted.size),
        float(counted.mean()) if counted.size else 0.0,
    )


def _change(env: BrakingEnv, camera: EgoCamera, target: Any) -> np.ndarray:
    """Return by how much the target changes each pixel [grey levels]."""
    road = env.road
    vehicles, objects = road.vehicles, road.objects
    present = camera.render(env).astype(np.float64)
    road.vehicles = [item for item in vehicles if item is not target]
    road.objects = [item for item in objects if item is not target]
    absent = camera.render(env).astype(np.float64)
    road.vehicles, road.objects = vehicles, objects
    return np.abs(present - absent)


COLUMNS: tuple[tuple[str, Callable[[Frontier], float], str], ...] = (
    ("time left [s]", lambda item: item.time_left, "{:.2f}"),
    ("distance [m]", lambda item: item.view.distance, "{:.1f}"),
    ("bearing [°]", lambda item: abs(item.view.bearing_deg), "{:.0f}"),
    ("width [°]", lambda item: item.view.width_deg, "{:.1f}"),
    ("growth [°/s]", lambda item: item.growth_deg_s, "{:.1f}"),
    ("drift [°/s]", lambda item: abs(item.drift_deg_s), "{:.1f}"),
    ("pixels", lambda item: item.view.pixels, "{:.0f}"),
    ("contrast", lambda item: item.view.contrast, "{:.0f}"),
    ("visible for [s]", lambda item: item.seen_s, "{:.1f}"),
)
TARGETS = {"CC": "cars", "CM": "motorcycles", "CP": "pedestrians", "CB": "bicycles"}


def by_family(items: Iterable[Frontier | None]) -> dict[str, list[Frontier]]:
    """Return the frontiers of the cases with a contact, by family."""
    families: dict[str, list[Frontier]] = {}
    for item in items:
        if item is not None:
            families.setdefault(item.family, []).append(item)
    return families


def table(families: dict[str, list[Frontier]], camera: Camera) -> list[str]:
    """Return the lines of the table."""
    inside = [PRESETS[name] for name in ("fovea", "wide")]
    heads = ["family", "cases", "avoidable", *(name for name, _, _ in COLUMNS)]
    heads[-3:-3] = [f"growth in `{camera.name}` [px/frame]", *(f"inside `{item.name}`" for item in inside)]
    lines = [heads, ["---"] * len(heads)]
    for family, items in families.items():
        cells = [text.format(median(map(value, items))) for _, value, text in COLUMNS]
        shares = [
            sum(abs(item.view.bearing_deg) < preset.hfov_deg / 2 for item in items) for preset in inside
        ]
        growth = median(item.growth_px(camera) for item in items)
        cells[-3:-3] = [f"{growth:.2f}", *(f"{share}/{len(items)}" for share in shares)]
        avoidable = sum(item.avoidable for item in items)
        lines.append([family, str(len(items)), f"{avoidable}/{len(items)}", *cells])
    return [f"| {' | '.join(line)} |" for line in lines]


def draw(families: dict[str, list[Frontier]], camera: Camera, path: Path) -> None:
    """Draw growth against bearing, one panel per kind of target and one point per case."""
    with saved_figure(path, 2, 2, sharex=True, sharey=True, figsize=(10, 8)) as (figure, panels):
        for (prefix, target), axes in zip(TARGETS.items(), panels.flat, strict=True):
            for family, items in families.items():
                if family.startswith(prefix):
                    bearings = [abs(item.view.bearing_deg) for item in items]
                    growths = [max(item.growth_px(camera), 0.02) for item in items]
                    axes.scatter(bearings, growths, s=14, alpha=0.7, label=family)
            axes.axvline(camera.hfov_deg / 2, color="grey", linestyle="--", linewidth=1)
            axes.axhline(1.0, color="grey", linestyle=":", linewidth=1)
            axes.set(title=target, yscale="log")
            if any(family.startswith(prefix) for family in families):
                axes.legend(frameon=False, fontsize=8, loc="lower right")
        edge = (camera.hfov_deg / 2, 0.04)
        panels[0, 0].annotate(f" edge of {camera.name}", edge, fontsize=8, color="grey")
        figure.supxlabel("bearing of the target's centre from the optical axis [°]")
        figure.supylabel(f"growth of the target's width in {camera.name} [px/frame]")
        figure.suptitle("The target at the last decision at which full braking avoids the contact")


def main() -> None:
    """Print the table and draw the figure."""
    parser = argparse.ArgumentParser(description="Frontier of the protocol suites")
    parser.add_argument("--suites", nargs="+", default=["ncap2023", "ncap2023-vru", "ncap2026"])
    parser.add_argument("--camera", default="wide", help="preset of the camera")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--to", type=Path, help="picture to write")
    arguments = parser.parse_args()
    camera = Camera.make(arguments.camera)
    cases = [case for name in arguments.suites for case in find_suite(name).cases]
    items = Parallel(n_jobs=arguments.jobs)(delayed(frontier)(case, camera) for case in cases)
    families = dict(sorted(by_family(items).items()))
    print("\n".join(table(families, camera)))
    if arguments.to:
        draw(families, camera, arguments.to)


if __name__ == "__main__":
    main()
