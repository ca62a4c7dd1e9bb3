"""Make the README's links absolute and add the links of the project, for the page of a package index.

python .github/absolute_links.py https://HOST/OWNER/NAME TAG

The repository does not contain its own address: publish.yml passes that of the repository in which it runs.
The files README.md and pyproject.toml of the working folder are changed.
"""

import re
import sys
from pathlib import Path

LINK = re.compile(r"(!?)(\[[^\]]*\])\((?!https?:|#)([^)]+)\)")
URLS = """
[project.urls]
Repository = "{address}"
Documentation = "{address}/tree/{tag}/docs"
Changelog = "{address}/blob/{tag}/CHANGELOG.md"
Issues = "{address}/issues"
"""


def absolute(text: str, address: str, tag: str) -> str:
    """Return Markdown text with the address and tag before the target of every relative link and picture."""

    def replace(match: re.Match[str]) -> str:
        mark, label, target = match.groups()
        return f"{mark}{label}({address}/{'raw' if mark else 'blob'}/{tag}/{target})"

    return LINK.sub(replace, text)


def main(address: str, tag: str) -> None:
    """Rewrite README.md, and add `project.urls` to pyproject.toml unless it has them."""
    readme, project = Path("README.md"), Path("pyproject.toml")
    readme.write_text(absolute(readme.read_text("utf-8"), address, tag), "utf-8")
    text = project.read_text("utf-8")
    if "[project.urls]" not in text:
        project.write_text(text + URLS.format(address=address, tag=tag), "utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3 or not sys.argv[1].startswith("https://"):
        sys.exit("usage: python .github/absolute_links.py https://HOST/OWNER/NAME TAG")
    main(sys.argv[1].rstrip("/"), sys.argv[2])
