"""What each command does with its parsed options."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

if TYPE_CHECKING:
    from lgmd_gym.cli.options import Doctor, Drive, Gallery, List


def drive(options: "Drive") -> int:
    """Play one episode and say how it ended."""
    from lgmd_gym.agents import make_agent
    from lgmd_gym.benchmark.sensors import SensorConfig
    from lgmd_gym.rendering.playback import drive as play

    agent = make_agent(options.agent)
    end = play(
        options.target,
        agent,
        options.seed,
        _parse_arguments(options.set),
        video=options.video,
        live=options.live,
        overlays=options.overlays,
        **SensorConfig(options.camera, _read_params(options.params)).of(agent).arguments,
    )
    if end.stopped:
        print(f"window closed after {end.duration:.2f} s")
    elif end.collision:
        print(f"contact at {3.6 * end.impact_speed:.1f} km/h relative speed after {end.duration:.2f} s")
    else:
        gap = f"{end.gap:.2f} m ahead free" if end.gap == end.gap else "nothing ahead"
        print(f"no contact: {3.6 * end.ego_speed:.1f} km/h after {end.duration:.2f} s, {gap}")
    if options.video is not None:
        print(f"video: {options.video}")
    return 0


def show_list(options: "List") -> int:
    """Print what there is to name."""
    from lgmd_gym.cli import listing

    listing.show(options.what, console_of())
    return 0


def gallery(options: "Gallery") -> int:
    """Make the gallery and say where it is."""
    from lgmd_gym.gallery.build import make_gallery

    page = make_gallery(options.out, options.families, options.agent, options.seeds, console_of().print)
    print(f"gallery: {page}")
    return 0


def doctor(options: "Doctor") -> int:
    """Examine this installation; 1 if something is at fault."""
    from lgmd_gym.cli import checks as doctors

    console = console_of()
    with console.status("the first drive on a machine compiles the kernels, up to a minute"):
        return int(doctors.report(doctors.examine(), console) > 0)


def console_of(width: int = 110) -> Console:
    """Return the terminal, or for a file or pipe a page wide enough for the tables."""
    console = Console()
    return console if console.is_terminal else Console(width=width)


def _read_params(path: Path | None) -> dict[str, Any] | None:
    """Return the LGMD parameters of a TOML file as plain values."""
    if path is None:
        return None
    from lgmd_gym.neuron import LGMDParams

    try:
        return LGMDParams.from_toml(path).to_dict()
    except OSError as error:
        raise ValueError(f"params file {str(path)!r} cannot be read: {error.strerror}") from None


def _parse_arguments(pairs: tuple[str, ...]) -> dict[str, Any]:
    """Return name=value pairs as numbers by name."""
    arguments: dict[str, Any] = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        try:
            arguments[name] = int(value) if name == "shade" else float(value)
        except ValueError:
            raise ValueError(f"--set {pair!r} must be NAME=NUMBER, as in ego_speed=8.3") from None
    return arguments
