"""Picture of the rooms of the package: its folders, and which of them import which.

    python docs/architecture.py docs/_generated/static/architecture.svg

A room stands above all rooms that it imports. An arrow is left out where other arrows lead the same way.
"""

import ast
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import lgmd_gym

ROOT = Path(lgmd_gym.__file__).resolve().parent
WIDTH, ROW, HIGH = 960, 92, 50  # [px]: picture, distance of two rows, and height of a box
FONT = "font-family='system-ui, sans-serif'"
SUBJECTS = {
    "cli": "the command lgmd-gym",
    "report": "HTML page of a run, gallery",
    "training": "online, on recordings",
    "openscenario": "read and write scenarios",
    "paper": "stimuli, claims, figures",
    "rendering": "dashboard, window, video",
    "tuning": "search of parameters",
    "benchmark": "suites, runs, rows, scores",
    "clips": "neuron on video files",
    "comparison": "comparison of neurons",
    "agents": "rules, oracles, policies",
    "engine": "N environments, compiled",
    "plotting": "figures in one style",
    "envs": "scenarios, physics, traffic",
    "wrappers": "sensors for highway-env",
    "sensing": "cameras with neurons",
    "camera": "frames, worlds, weather",
    "neuron": "LGMD and other models",
    "kernels": "compilation",
    "processes": "pool, files, signals",
    "statistics": "intervals, bootstrap",
}


def modules() -> Iterator[tuple[str, Path]]:
    """Yield the room of every module, and its file."""
    for folder in sorted(path for path in ROOT.iterdir() if (path / "__init__.py").exists()):
        for path in sorted(folder.resolve().rglob("*.py")):
            yield folder.name, path


def imported(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the rooms that the import statements among some nodes name."""
    names = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
    return {name.split(".")[1] for name in names if name.startswith("lgmd_gym.")}


def rooms() -> dict[str, set[str]]:
    """Return the rooms that each room imports, inside functions too unless that closes a circle."""
    graph: dict[str, set[str]] = {}
    later: list[tuple[str, str]] = []
    for room, path in modules():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        graph.setdefault(room, set()).update(imported(tree.body))
        later += [(room, other) for other in sorted(imported(ast.walk(tree)))]
    graph = {room: (others & graph.keys()) - {room} for room, others in graph.items()}
    for room, other in later:
        if other in graph and other != room and room not in reachable(graph, other, set()):
            graph[room].add(other)
    return graph


def reachable(graph: dict[str, set[str]], room: str, seen: set[str]) -> set[str]:
    """Return the rooms that a room imports, directly or not."""
    for other in graph[room] - seen:
        seen.add(other)
        reachable(graph, other, seen)
    return seen


def floors(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the rooms by floor, the lowest first: those that import only rooms of lower floors."""
    found: list[list[str]] = []
    left = dict(graph)
    while left:
        lowest = [room for room, others in left.items() if not others & left.keys()]
        if not lowest:
            raise ValueError(f"rooms import each other: {', '.join(left)}")
        found.append(sorted(lowest))
        left = {room: others for room, others in left.items() if room not in lowest}
    return found


def svg() -> str:
    """Return the picture."""
    graph = rooms()
    rows = floors(graph)
    place = {
        room: (WIDTH * (column + 0.5) / len(row), ROW * (len(rows) - 1 - floor) + 30)
        for floor, row in enumerate(rows)
        for column, room in enumerate(row)
    }
    parts = []
    for room, others in graph.items():
        (x, y), direct = place[room], set(others)
        for other in others:
            direct -= reachable(graph, other, set())
        for other in sorted(direct):
            to_x, to_y = place[other]
            bend = 0.5 * (to_y - y - HIGH)
            parts.append(
                f"<path d='M{x:.0f},{y + HIGH:.0f} c0,{bend:.0f} {to_x - x:.0f},{bend:.0f} "
                f"{to_x - x:.0f},{to_y - y - HIGH - 5:.0f}' fill='none' stroke='#8a94a6' "
                "stroke-width='1.2' marker-end='url(#tip)'/>"
            )
    size = min(WIDTH / max(map(len, rows)) - 12, 190)
    for room, (x, y) in place.items():
        parts.append(
            f"<rect x='{x - size / 2:.0f}' y='{y:.0f}' width='{size:.0f}' height='{HIGH}' rx='6' "
            "fill='#eef3fa' stroke='#4b6b94'/>"
            f"<text x='{x:.0f}' y='{y + 20:.0f}' text-anchor='middle' {FONT} font-size='14' "
            f"font-weight='600' fill='#1c2b3f'>{room}</text>"
            f"<text x='{x:.0f}' y='{y + 38:.0f}' text-anchor='middle' {FONT} font-size='11' "
            f"fill='#4a5a70'>{SUBJECTS.get(room, '')}</text>"
        )
    tip = (
        "<defs><marker id='tip' viewBox='0 0 8 8' refX='6' refY='4' markerWidth='7' markerHeight='7' "
        "orient='auto'><path d='M0,0 L8,4 L0,8 z' fill='#8a94a6'/></marker></defs>"
    )
    height = ROW * len(rows) + 10
    return (
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {height}'>"
        f"<rect width='{WIDTH}' height='{height}' fill='white'/>{tip}{''.join(parts)}</svg>\n"
    )


def main(path: Path) -> None:
    """Write the picture."""
    path.write_text(svg(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
