"""The gallery's page: one HTML file with its style inside, films and pictures beside it."""

import re
from html import escape

from lgmd_gym._version import __version__
from lgmd_gym.gallery.docstrings import About
from lgmd_gym.gallery.scenes import Scene
from lgmd_gym.gallery.style import SCRIPT, STYLE

Sheet = dict[str, dict[str, str]]


GROUPS = (
    ("threats", "Threats", "Nobody braking means contact here: the brake has to come, and not too early."),
    (
        "quiet",
        "Where braking is the fault",
        "Nothing touches although nobody brakes: the neuron should keep calm.",
    ),
    (
        "traffic",
        "Traffic",
        "highway-env's roads and cars; the agent may only add braking. Single drives judge nothing: "
        "<code>lgmd-gym bench --suite traffic</code> counts needless brakes per 100 km.",
    ),
)


def page(
    scenes: list[Scene],
    verdicts: dict[str, dict[str, str]],
    sheets: dict[str, Sheet],
    agent: str,
    seeds: int,
) -> str:
    """Return the page.

    Args:
        scenes: Whose films are in `media/`.
        verdicts: Scene to agent to words.
        sheets: "lenses" and "roads", each row to column to file; may be empty.
        agent: Who brakes in the films.
        seeds: Seeds per scene behind the verdicts.
    """
    sections = []
    for key, title, lead in GROUPS:
        cards = [
            _card(scene, verdicts[scene.name], agent) for scene in scenes if _group(scene, verdicts) == key
        ]
        if cards:
            sections.append((key, title, f"<p>{lead}</p><div class=cards>{''.join(cards)}</div>"))
    if "lenses" in sheets:
        words = (
            "One moment, 16 m before a standing car, through each lens under each condition; degraded means "
            "noise, vibration, brake dive, heave and 11 ms of exposure."
        )
        sections.append(("conditions", "Lenses and conditions", f"<p>{words}</p>{_sheet(sheets['lenses'])}"))
    if "roads" in sheets:
        words = "highway-env's own environments through the wide camera."
        sections.append(("roads", "Roads", f"<p>{words}</p>{_sheet(sheets['roads'])}"))
    links = "".join(f'<a href="#{key}">{title}</a>' for key, title, _ in sections)
    body = "".join(
        f'<section id="{key}"><h2>{title}</h2>{inside}</section>' for key, title, inside in sections
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1"><title>lgmd-gym gallery</title>'
        f"<style>{STYLE}</style></head><body><header><h1>lgmd-gym gallery</h1>"
        "<p>A camera on a highway-env car feeds grey frames to a locust looming neuron; agents brake on its "
        f"spike frequency. In the films <b>{escape(agent)}</b> brakes; move the pointer over one to play it."
        f"</p><nav>{links}</nav></header><main>{_key(scenes)}{body}</main><footer class=faint>"
        f"lgmd-gym {__version__}. Verdicts: each scenario with its default arguments, {seeds} seeds, camera "
        "fovea at 30 Hz. Simulated runs with a steady camera: they say nothing about a real car.</footer>"
        f"<script>{SCRIPT}</script></body></html>\n"
    )


def _group(scene: Scene, verdicts: dict[str, dict[str, str]]) -> str:
    """Return the section of a scene: what happens to who never brakes decides."""
    if not scene.judged:
        return "traffic"
    return "threats" if "avoided" in verdicts[scene.name]["no-brake"] else "quiet"


def _key(scenes: list[Scene]) -> str:
    """Return how to read a picture, beside a large one."""
    items = (
        "<b>Large:</b> what the eye sees. Blue lines: the danger zone, the lane straight "
        "ahead. Yellow corners: bodies ahead.",
        "<b>Small maps:</b> the neuron's layers. P change, I the delayed inhibition it is weighed "
        "against, S what is left, G what clusters, which means it looms.",
        "<b>Below left:</b> spikes of each camera frame, and their frequency with the alert level.",
        "<b>Below right:</b> the road from above. <b>Top:</b> lamps for alert, braking and contact.",
    )
    shown = next((scene.name for scene in scenes if scene.name == "CCRs"), scenes[0].name)
    listed = "".join(f"<li>{item}</li>" for item in items)
    return (
        f'<section><h2>How to read a picture</h2><div class=key><img src="media/{shown}.jpg" '
        f'alt="The composed picture of {shown}"><ul>{listed}</ul></div></section>'
    )


def _card(scene: Scene, words: dict[str, str], agent: str) -> str:
    rows = "".join(
        f"<tr><th>{escape(name)}</th><td class={'good' if is_good(said) else 'bad'}>{escape(said)}</td></tr>"
        for name, said in words.items()
    )
    verdict = f"<table>{rows}</table>" if rows else ""
    film = f'src="media/{scene.name}.mp4" poster="media/{scene.name}.jpg"'
    command = f"lgmd-gym drive {escape(scene.target)} --agent {escape(agent)} --live"
    return (
        f'<article id="{scene.name}"><video {film} muted loop playsinline controls preload=none></video>'
        f"<div><h3>{escape(scene.name)}</h3><p>{_inline(scene.about.lead)}</p>{verdict}"
        f"{_details(scene.about)}<p><code>{command}</code></p></div></article>"
    )


def is_good(words: str) -> bool:
    """Return whether a verdict tells of nothing wrong."""
    shares = [(int(k), int(n)) for k, n in re.findall(r"avoided (\d+)/(\d+)", words)]
    needless = any(int(k) for k in re.findall(r"needless braking (\d+)/", words))
    return words != "failed" and "contact" not in words and not needless and all(k == n for k, n in shares)


def _details(about: About) -> str:
    """Return what else the docstring says, folded away."""
    paragraphs = [part for part in about.text.split("\n\n") if part.strip() and not part.startswith("#")]
    text = "".join(f"<p>{_inline(part)}</p>" for part in paragraphs)
    rows = "".join(
        f"<tr><th><code>{name}</code></th><td>{escape(default)}</td><td>{_inline(said)}</td></tr>"
        for name, default, said in about.arguments
    )
    table = f"<table>{rows}</table>" if rows else ""
    return f"<details><summary>more</summary>{text}{table}</details>" if text or table else ""


def _inline(text: str) -> str:
    """Return a docstring's text as HTML: code in backticks, all else escaped."""
    return re.sub(r"`+([^`]+)`+", r"<code>\1</code>", escape(" ".join(text.split())))


def _sheet(sheet: Sheet) -> str:
    columns = list(dict.fromkeys(column for row in sheet.values() for column in row))
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    rows = ""
    for name, files in sheet.items():
        cells = "".join(
            f'<td><img loading=lazy src="media/{files[column]}" alt="{escape(name)}, {escape(column)}"></td>'
            for column in columns
        )
        rows += f"<tr><th>{escape(name)}</th>{cells}</tr>"
    return f"<div class=sheet><table><tr><th></th>{head}</tr>{rows}</table></div>"
