"""The words that the style guide rules out appear in no source file and on no page."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("lgmd_gym", "envs", "agents", "tests", "docs")
SUFFIXES = {".py", ".md", ".html", ".yml", ".toml"}
BANNED = re.compile(
    r"\b(mend(s|ed|ing)?|told|tells|somebody|nobody|anybody|dearer|wish(es|ed)?|lived|unlearnt|thereof"
    r"|worn(?! (paint|marking|markings|road|asphalt))|gone on with|leaves? to be desired"
    r"|what it is made of|a breath of|deaf ear)\b",
    re.IGNORECASE,
)
QUOTATION = re.compile(r'"[^"\n]*"|^>.*$', re.MULTILINE)  # only Markdown quotes people


def files():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            hidden = {"_generated", "_build", "__pycache__"} & set(path.parts)
            if path.suffix in SUFFIXES and not hidden and path != Path(__file__).resolve():
                yield path
    yield from sorted(ROOT.glob("*.md"))


def test_no_banned_word():
    found = []
    for path in files():
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".md":
            text = QUOTATION.sub("", text)
        for number, line in enumerate(text.splitlines(), start=1):
            found += [f"{path.relative_to(ROOT)}:{number}: {match[0]}" for match in BANNED.finditer(line)]
    assert found == [], "\n".join(found)


def test_the_pattern_matches_every_listed_word():
    words = ["mend", "told", "tells", "somebody", "nobody", "anybody", "dearer", "wish", "worn", "lived"]
    words += ["unlearnt", "thereof", "gone on with", "leave to be desired", "what it is made of"]
    words += ["a breath of", "deaf ear"]
    assert [word for word in words if not BANNED.search(f"a {word} b")] == []
    assert not BANNED.search("worn paint, amend, recommended")
