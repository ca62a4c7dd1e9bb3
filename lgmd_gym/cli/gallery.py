"""The `gallery` command."""

from functools import partial

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Gallery
from lgmd_gym.gallery.build import make_gallery


def run(options: Gallery) -> int:
    """Write the gallery and print its path."""
    names = options.families or ()
    log = partial(make_console().print, markup=False)
    page = make_gallery(options.out, names, options.agent, options.seeds, log)
    print(f"gallery: {page}")
    return 0
