"""The `gallery` command."""

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Gallery
from lgmd_gym.report.gallery.build import make_gallery


def run(options: Gallery) -> int:
    """Write the gallery and print its path."""
    names = options.families or ()
    page = make_gallery(options.out, names, options.agent, options.seeds, make_console().print)
    print(f"gallery: {page}")
    return 0
