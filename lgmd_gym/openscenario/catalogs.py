"""Catalogs: entries that scenarios refer to by name, with parameters of their own."""

from functools import lru_cache
from pathlib import Path

from lgmd_gym.errors import unknown_name
from lgmd_gym.openscenario.nodes import Element, Node, parse_file
from lgmd_gym.openscenario.parameters import assignments, declare


class Catalogs:
    """The catalogs of a scenario.

    Args:
        scenario: The root element of the scenario, with the values of its parameters.

    Attributes:
        visited: Nodes of the entries that were read.
    """

    def __init__(self, scenario: Element) -> None:
        self.visited: list[Node] = []
        locations = scenario.find("CatalogLocations")
        self._folders = [] if locations is None else list(_folders(locations))
        self._entries: dict[tuple[str, str], Node] | None = None

    def resolve(self, item: Element, *tags: str) -> Element:
        """Return an inline element with one of some tags, or the catalog entry that `item` refers to.

        Args:
            item: Element that contains the inline element or a `CatalogReference`.
            *tags: Tags of the inline element and of the entry.

        Raises:
            ValueError: If a name is unknown, or the entry is of another kind.
        """
        found = item.child(*tags, "CatalogReference")
        if found.tag != "CatalogReference":
            return Element(found.node, declare(found, {}))
        return self.entry(found, *tags)

    def entry(self, reference: Element, *tags: str) -> Element:
        """Return the entry of a `CatalogReference`, with the assigned parameters."""
        catalog, name = reference.text("catalogName"), reference.text("entryName")
        entries = self._load()
        if (catalog, name) not in entries:
            names = {known for _, known in entries} if entries else {folder.name for folder in self._folders}
            error = unknown_name(f"entry of catalog {catalog!r}", name, names)
            raise reference.error(str(error))
        node = entries[catalog, name]
        if node.tag not in tags:
            raise reference.error(f"entry {name!r} is a {node.tag}, not a {' or '.join(tags)}")
        self.visited.append(node)
        return Element(node, declare(Element(node, {}), assignments(reference)))

    def _load(self) -> dict[tuple[str, str], Node]:
        if self._entries is None:
            files = [path for folder in self._folders for path in sorted(folder.glob("*.xosc"))]
            self._entries = _entries(tuple(map(parse_file, files)))
        return self._entries


@lru_cache(maxsize=32)
def _entries(files: tuple[Node, ...]) -> dict[tuple[str, str], Node]:
    """Return the entries of catalog files by catalog and name."""
    entries = {}
    for file in files:
        for catalog in file.children:
            if catalog.tag == "Catalog":
                for node in catalog.children:
                    entries[catalog.attributes.get("name", ""), node.attributes.get("name", "")] = node
    return entries


def _folders(locations: Element) -> list[Path]:
    folders = []
    for node in locations.node.children:
        directory = Element(node, locations.scope).child("Directory")
        folder = locations.node.file.parent / directory.text("path")
        if not folder.is_dir():
            raise directory.error(
                f"the folder {directory.text('path')!r} does not exist; check CatalogLocations"
            )
        folders.append(folder)
    return list(dict.fromkeys(folders))
