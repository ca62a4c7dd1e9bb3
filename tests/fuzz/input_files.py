"""Odd files of other people: `python tests/fuzz/input_files.py --seconds 60 [--kind times]`.

A case is a file with a right value or a fault of one kind: frames of a video that are dropped, display
matrices, encodings and default attributes of OpenSCENARIO, names of suites, huge numbers, deep nesting, and
policy cards. Reading must return the value that was written, or raise a ValueError of one line that contains
the file.
"""

import json
import math
import os
import struct
import sys
import tempfile
import warnings
import zipfile
from functools import cache
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import av
import numpy as np
from support.fuzz import run_cases
from support.openscenario import AWAY, START, STRAIGHT, entity_condition, event, scenario, story

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import CARD, policy_card
from lgmd_gym.agents.policies.policy import SHIPPED
from lgmd_gym.benchmark.suites import load_suite
from lgmd_gym.clips import VideoReader, luma
from lgmd_gym.clips.video import probe
from lgmd_gym.openscenario.reader import read_cells

FPS, SIZE = 30, 16  # [Hz] of the clips, and width and height [pixels]
MP4 = {"clip.mkv": "ffv1", "clip.avi": "ffv1", "clip.mp4": "mpeg4", "clip.mov": "mpeg4"}


def refused(call, *texts):
    """Return the result of a call, or the message of its ValueError: one line that contains some texts."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return call(), ""
    except ValueError as error:
        message = str(error)
    assert len(message.splitlines()) == 1, message
    assert all(text in message for text in texts), f"{texts} are not in {message!r}"
    return None, message


def write_frames(path, codec, pictures, stamps):
    """Write grey pictures, uint8 of shape (H, W), at time stamps in frames."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS)
        stream.height, stream.width = pictures[0].shape
        stream.pix_fmt = "yuv420p"
        stream.codec_context.gop_size = 5
        stream.codec_context.bit_rate = 2_000_000
        for picture, stamp in zip(pictures, stamps, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, "gray").reformat(format="yuv420p")
            frame.pts = stamp
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def times(rng, folder):
    """Frames are missing in up to three gaps: each frame keeps its time, and the last before a gap stays."""
    kept = np.ones(40, bool)
    for _ in range(rng.integers(4)):
        start = rng.integers(1, 38)
        kept[start : start + rng.integers(1, 9)] = False
    kept[39] = True
    stamps = np.flatnonzero(kept)
    name = list(MP4)[rng.integers(len(MP4))]
    levels = rng.permutation(np.arange(20, 220, 5))[: len(stamps)]

    def check():
        path = folder / name
        pictures = [np.full((SIZE, SIZE), level, np.uint8) for level in levels]
        write_frames(path, MP4[name], pictures, stamps.tolist())
        info = probe(path)
        assert info.frames == len(stamps), (info, stamps)
        assert abs(info.duration - 40 / FPS) < 0.002, info
        assert [info.time_of(k) for k in range(len(stamps))] == [_near(stamp / FPS) for stamp in stamps]
        shown = [int(np.median(luma(picture))) for picture in VideoReader(path)]
        expected = [levels[np.flatnonzero(stamps <= number)[-1]] for number in range(40)]
        assert np.abs(np.array(shown) - expected).max() <= 2, (shown, expected)

    return f"{name}, gaps before the frames {stamps[1:][np.diff(stamps) > 1].tolist()}", check


class _near(float):
    """A time that equals another within 1 ms."""

    def __eq__(self, other):
        return abs(float(self) - other) < 0.0011

    __hash__ = float.__hash__


TURNS = [(a, 0, 0, d) for a in (1, -1) for d in (1, -1)] + [(0, b, c, 0) for b in (1, -1) for c in (1, -1)]


@cache
def upright():
    """Return a clip with four levels, and its picture."""
    picture = np.kron(np.array([[30, 90], [150, 210]], np.uint8), np.ones((16, 24), np.uint8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        write_frames(path, "mpeg4", [picture] * 3, range(3))
        return path.read_bytes(), luma(next(iter(VideoReader(path))))


def matrices(rng, folder):
    """The matrix in the header of an mp4 file: quarter turns and mirrors of any scale, or a slanted one."""
    matrix = np.array(TURNS[rng.integers(8)], float) * rng.choice((1.0, 0.5, 2.0))
    slanted = rng.random() < 0.3
    if slanted:
        angle = rng.uniform(0.1, math.pi / 2 - 0.1)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        matrix = (matrix.reshape(2, 2) @ turn).ravel()

    def check():
        data, picture = upright()
        path, place = folder / "turned.mp4", data.index(b"tkhd") + 44
        a, b, c, d = (round(float(value) * 65536) for value in matrix)
        header = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
        path.write_bytes(data[:place] + header + data[place + 36 :])
        found, message = refused(lambda: luma(next(iter(VideoReader(path)))), str(path))
        assert bool(message) == slanted, (matrix, message)
        if slanted:
            return
        unit = np.sign(np.array((a, b, c, d))).reshape(2, 2)
        y, x = np.indices(picture.shape)
        seen = np.stack([x, y], -1) @ unit
        seen -= seen.reshape(-1, 2).min(0)
        expected = np.zeros(seen.reshape(-1, 2).max(0)[::-1] + 1, np.uint8)
        expected[seen[..., 1], seen[..., 0]] = picture
        assert found.shape == expected.shape
        assert np.abs(found.astype(int) - expected).mean() < 2.0, matrix

    return f"matrix {matrix.round(3).tolist()}", check


ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "us-ascii", "windows-1252", "koi8-r", "utf-32",
             "shift_jis", "gb2312", "nix", "")  # fmt: skip
NAMES = ("Target", "Zïel", "目标", "Цель", "a b")


def encodings(rng, folder):
    """A scenario in an encoding: the name of its target as written, or an error with the file."""
    encoding, name = (choices[rng.integers(len(choices))] for choices in (ENCODINGS, NAMES))

    def check():
        stated = "utf-8" if encoding == "utf-8-sig" else encoding
        text = scenario(START).replace('"Target"', f'"{name}"')
        text = f'<?xml version="1.0" encoding="{stated}"?>\n{text}'
        try:
            data, written = text.encode(encoding), True
        except (LookupError, UnicodeError):  # the file does not have its encoding
            data, written = text.encode(), False
        path = folder / "case.xosc"
        path.write_bytes(data)
        (folder / "road.xodr").write_text(STRAIGHT)
        cells, message = refused(lambda: read_cells(path), f"{path}:")
        assert cells or not written or encoding not in ENCODINGS[:5], message
        if cells and written:
            assert list(cells[0].compiled.world.movers) == ["Ego", name]

    return f"encoding {encoding!r}, name {name!r}", check


HEADWAY = ('<TimeHeadwayCondition entityRef="Target" value="3" freespace="false" rule="lessThan"/>',)
DEFAULTS = (
    ("<LanePosition ", 'offset="0"'),
    ("<SpeedActionDynamics ", 'followingMode="position"'),
    ("<Event ", 'maximumExecutionCount="1"'),
    ("<TimeHeadwayCondition ", 'relativeDistanceType="euclidianDistance"'),
    ("<TimeHeadwayCondition ", 'coordinateSystem="entity"'),
    ("<TimeHeadwayCondition ", 'routingAlgorithm="undefined"'),
    ("<TimeHeadwayCondition ", 'alongRoute="false"'),
)
"""Starts of elements, and optional attributes with the default of the standard."""


def defaults(rng, folder):
    """Optional attributes that state their defaults change nothing; other values do or are refused."""
    stated = [item for item in DEFAULTS if rng.random() < 0.5]
    plain = scenario(START, story("Target", event("E", AWAY, entity_condition(HEADWAY[0]))))

    def check():
        text = plain
        for start, attribute in stated:
            text = text.replace(start, f"{start}{attribute} ")
        (folder / "road.xodr").write_text(STRAIGHT)
        found = []
        for content in (plain, text):
            path = folder / "case.xosc"
            path.write_text(content)
            (cell,), _ = refused(lambda path=path: read_cells(path))
            found.append(cell.compiled)
        assert found[0].scenario == found[1].scenario
        segment = found[0].world.movers["Target"].timeline.segments[0]
        assert abs(segment.start - 3.0) < 1e-6, segment  # 60 m less 3 s at 10 m/s

    return f"defaults {[attribute for _, attribute in stated]}", check


PARTS = ("a", "B7", "/", "\\", "..", " ", "ü", "\t", "\x7f", ":", "-", "_", ".", "0", "x" * 300, "#", "'")


def names(rng, folder):
    """A name of a suite or case: case names can be split again, or the name is refused with the file."""
    name = "".join(PARTS[i] for i in rng.integers(len(PARTS), size=rng.integers(5)))
    case = "".join(PARTS[i] for i in rng.integers(len(PARTS), size=rng.integers(1, 4)))

    def check():
        path = folder / "suite.toml"
        values = f'name = {json.dumps(name)}\n\n[[cases]]\nfamily = "CCRs"\nname = {json.dumps(case)}\n'
        path.write_text(values + "arguments = { ego_speed = 8.3 }\n", encoding="utf-8")
        suite, message = refused(lambda: load_suite(path), str(path))
        if suite is None:
            assert "name" in message, message
            return
        (found,) = suite.cases
        assert "/" not in suite.name
        assert found.name.split("/", 2) == [suite.name, found.family, found.variant]

    return f"suite {name[:40]!r}, case {case[:40]!r}", check


NUMBERS = ("1e308", "-1e308", "1e-320", "1e400", "-1e400", "nan", "-inf", "9" * 400, "0x10", "1_0", "1,5",
           "", " 7 ", "1e", "--1", "0", "-0", "${1/0}", "${" + "(" * 400 + "1" + ")" * 400 + "}", "${10 ^ 2}",
           "$nix", "${pow(10, 400)}", "true")  # fmt: skip


def numbers(rng, folder):
    """A number of a scenario or of its road is replaced; it is read or refused with file and line."""
    text = scenario(START, story("Target", event("E", AWAY, entity_condition(HEADWAY[0]))))
    road = rng.random() < 0.4
    source = STRAIGHT if road else text
    places = [
        i for i in range(1, len(source)) if source[i - 1] == '"' and (source[i].isdigit() or source[i] == "-")
    ]
    place = places[rng.integers(len(places))]
    number = NUMBERS[rng.integers(len(NUMBERS))]
    changed = source[:place] + number + source[source.index('"', place) :]

    def check():
        path, roads = folder / "case.xosc", folder / "road.xodr"
        path.write_text(text if road else changed)
        roads.write_text(changed if road else STRAIGHT)
        cells, message = refused(lambda: read_cells(path))
        assert cells or str(roads if road else path) in message or str(path) in message, message

    return f"{source[max(place - 40, 0) : place]!r} {number[:40]!r}", check


def nesting(rng, folder):
    """Elements, groups of constraints and JSON within each other, from a few to many."""
    depth = int(10 ** rng.uniform(0.5, 4.8))
    kind = ("elements", "groups", "json", "toml")[rng.integers(4)]

    def check():
        if kind == "json":
            path = folder / "card.zip"
            with zipfile.ZipFile(path, "w") as archive:
                archive.writestr(CARD, '{"algo": "ppo", "camera": ' + "[" * depth + "]" * depth + "}")
            call = lambda: policy_card(path)  # noqa: E731
        elif kind == "toml":
            path = folder / "suite.toml"
            path.write_text(f'name = "a"\ncases = {"[" * depth}{"]" * depth}\n')
            call = lambda: load_suite(path)  # noqa: E731
        else:
            path = folder / "case.xosc"
            inside = "<A>" * depth + "</A>" * depth
            if kind == "groups":
                group = '<ConstraintGroup><ValueConstraint rule="greaterThan" value="0"/>'
                inside = f'<ParameterDeclaration name="p" parameterType="double" value="1">{group * depth}'
                inside += "</ConstraintGroup>" * depth + "</ParameterDeclaration>"
            path.write_text(scenario(START, parameters=inside))
            (folder / "road.xodr").write_text(STRAIGHT)
            call = lambda: read_cells(path)  # noqa: E731
        refused(call, str(path))

    return f"{kind}, {depth} deep", check


FILES = ("vn.npz", "../vn.npz", "/tmp/vn.npz", "a/vn.npz", "..", ".", "", "C:\\vn.npz", "..\\vn.npz",
         "vn.pkl", "x" * 5000, "a\nb", "\u0000")  # fmt: skip
SIZES = (
    [8],
    [10_000] * 200,
    [-1],
    [0],
    [1e400],
    [10**30],
    ["8"],
    [[8]],
    [8] * 5000,
    {"pi": [8], "vf": [10**9]},
)


def cards(rng, folder):
    """A card with statistics outside its folder, or a huge network: refused, and nothing is read."""
    kind = rng.integers(2)
    value = (FILES, SIZES)[kind][rng.integers(len((FILES, SIZES)[kind]))]

    def check():
        path = folder / "inner" / "policy.zip"
        path.parent.mkdir(exist_ok=True)
        with zipfile.ZipFile(SHIPPED / "all-round.zip") as source, zipfile.ZipFile(path, "w") as target:
            for name in source.namelist():
                data = source.read(name)
                if name == CARD:
                    card = json.loads(data)
                    card |= {"vec_normalize": value} if kind == 0 else {}
                    if kind == 1 and card.get("network"):
                        card["network"]["net_arch"] = value
                    data = json.dumps(card)
                target.writestr(name, data)
        (folder / "vn.npz").write_bytes(b"nothing to read here")
        found, message = refused(lambda: make_agent(f"policy:{path}"), str(folder))
        plain = (
            isinstance(value, str)
            and value == Path(value.replace("\\", "/")).name
            and value not in ("", "..", ".")
        )
        assert kind == 1 or found is None, value  # none of the files is there
        assert kind == 1 or plain or "vec_normalize" in message, message

    return f"{('vec_normalize', 'net_arch')[kind]} {str(value)[:40]!r}", check


KINDS = {
    item.__name__: item for item in (times, matrices, encodings, defaults, names, numbers, nesting, cards)
}


def draw_case(rng, kind=None):
    """Return the description and the check of one file."""
    name = kind or list(KINDS)[rng.integers(len(KINDS))]
    holder = tempfile.TemporaryDirectory()
    text, run = KINDS[name](rng, Path(holder.name))

    def check():
        with holder:
            run()

    return f"{name}: {text}", check


if __name__ == "__main__":
    os.environ.setdefault("AV_LOG_LEVEL", "quiet")
    if "--kind" in sys.argv:
        place = sys.argv.index("--kind")
        chosen = sys.argv[place + 1]
        del sys.argv[place : place + 2]
    else:
        chosen = None
    sys.exit(run_cases(lambda rng: draw_case(rng, chosen), __doc__))
