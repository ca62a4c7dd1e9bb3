# pyright: standard
# Not strict: the type of a random draw of NumPy depends on its arguments.
"""Worlds: the appearance of road, surroundings, light and vehicles, drawn from one integer."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_known, check_whole

LABORATORY = "laboratory"
"""The name of the plain world: one asphalt, one skyline, no sun shadows, and a lens without errors."""
WORLDS = 10_000
"""Number of drawn worlds; they are numbered from 0."""
SPLIT_WORLDS = {
    "train": range(0, 6000),
    "validation": range(6000, 8000),
    "test": range(8000, 9000),
    "held-out": range(9000, 10_000),
}
"""Disjoint ranges of worlds; those held out are for final evaluations only."""

ASPHALTS = ("fresh", "aged", "patched", "cracked", "coarse", "concrete")
VERGES = ("grass", "gravel", "soil", "paving")
TILES = 2
"""Number of different textures per kind of ground."""
SKYLINES = 32
"""Number of different skylines."""

# Mean grey of a new to a weathered surface, display-coded. Asphalt reflects 5 % (new) to 15 % (aged) and
# concrete 20 % to 35 % of the light (Levinson and Akbari 2002, Cement and Concrete Research 32).
_ASPHALT_GREYS = {
    "fresh": (66.0, 92.0),
    "aged": (92.0, 132.0),
    "patched": (84.0, 122.0),
    "cracked": (96.0, 138.0),
    "coarse": (84.0, 124.0),
    "concrete": (124.0, 162.0),
}
_ASPHALT_CONTRASTS = {
    "fresh": (0.2, 0.6),
    "aged": (0.3, 1.0),
    "patched": (0.4, 1.2),
    "cracked": (0.4, 1.3),
    "coarse": (0.4, 1.1),
    "concrete": (0.25, 0.9),
}
_VERGE_GREYS = {
    "grass": (60.0, 110.0),
    "gravel": (92.0, 150.0),
    "soil": (70.0, 128.0),
    "paving": (92.0, 146.0),
}
_ASPHALT_SHARES = (0.16, 0.26, 0.18, 0.14, 0.14, 0.12)
_VERGE_SHARES = (0.5, 0.15, 0.2, 0.15)
# Length and period of the dashes of a lane line [m]: highway-env's, and those of several countries.
_DASHES = ((3.0, 4.33), (3.0, 9.0), (3.0, 12.0), (6.0, 18.0), (4.0, 12.0), (6.0, 9.0))
_LANE_WIDTHS = (3.25, 3.5, 3.75)
_OVERCAST_SHARE = 0.4  # of all daylight worlds


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """The appearance of an episode.

    Grey levels are display-coded, 255 for white, in the light of a clear or overcast day.
    """

    number: int = -1  # number of the world; -1 for the laboratory
    asphalt: tuple[str, int] = ("asphalt", 0)  # kind of the road's texture and its tile
    verge: tuple[str, int] = ("verge", 0)  # kind of the verge's texture and its tile
    asphalt_grey: float = 104.0  # mean grey of the road
    # contrast of the road, as a multiple of 9 grey levels per standard deviation
    asphalt_contrast: float = 1.0
    verge_grey: float = 76.0  # mean grey of the verge
    # contrast of the verge, as a multiple of 16 grey levels per standard deviation
    verge_contrast: float = 1.0
    paint_grey: float = 208.0  # grey of road markings
    line_width: float = 0.15  # width of the markings [m]
    dash: tuple[float, float] = (3.0, 4.33)  # length and period of a lane line's dashes [m]
    lane_width: float = 3.5  # width of the lanes of braking scenarios [m]
    skyline: int = -1  # its number
    hill_scale: float = 1.0  # height of the hills, as a multiple of the laboratory's
    tree_scale: float = 1.0  # height of the tree line, as a multiple of the laboratory's
    # grey of the sky at the zenith and at the horizon, of hills and of trees
    greys: tuple[float, float, float, float] = (172.0, 214.0, 128.0, 78.0)
    leaf_contrast: float = 12.0  # standard deviation of the grey of the trees
    roadside: float = 1.0  # density of posts and plants, as a multiple of the natural density
    guard_rail: bool = False  # whether guard rails run along the outer edges of the road
    sun_azimuth_deg: float = 143.13  # direction of the sun, from +x towards +y [degrees]
    sun_elevation_deg: float = 53.13  # elevation of the sun [degrees]
    # share of the light on a horizontal surface that comes directly from the sun; 0 under an overcast sky
    sun_share: float = 0.0
    street_light: float = 0.04  # light at night apart from headlights, as a share of daylight
    beam: float = 1.25  # peak of the light of the ego's low beam, as a share of daylight
    under_body: float = 0.66  # share of the light that is missing below the middle of a vehicle
    mount_height_error: float = 0.0  # height of the lens above that of its mount [m]
    pitch_error_deg: float = 0.0  # upward tilt of the optical axis relative to its mount [degrees]
    yaw_error_deg: float = 0.0  # turn of the optical axis to the right relative to its mount [degrees]
    noise: float = 0.0  # sensor noise as a multiple of the usual noise
    # mean grey to which the automatic exposure brings the road and its surroundings by day
    exposure_grey: float = 110.0
    night_exposure: float = 0.5  # the same at night, as a share of that by day
    exposure_s: float = 0.0  # time constant of the automatic exposure [s]; 0 for a fixed exposure
    # slope of the camera's tone curve at that grey; 1 for the square root of the light alone
    contrast: float = 1.0

    @property
    def drawn(self) -> bool:
        """Whether this is not the laboratory."""
        return self.number >= 0


@lru_cache(maxsize=256)
def draw_world(number: int | None) -> World:
    """Return a world; None for the laboratory.

    Args:
        number: Number of the world, from 0 to 9,999; the same in every process.

    Raises:
        ValueError: If there is no such world.
    """
    if number is None:
        return World()
    check_world(number)
    rng = np.random.default_rng([number, 10])
    return World(
        number=number,
        **_draw_ground(rng),
        **_draw_markings(rng),
        **_draw_surroundings(rng),
        **_draw_sun(rng),
        **_draw_camera(rng),
    )


def check_world(value: object) -> int | None:
    """Return the number of a world, or None for `LABORATORY`.

    Raises:
        ValueError: If there is no such world.
    """
    if isinstance(value, str):
        check_known("world", value, (LABORATORY,))
        return None
    return check_whole("world", value, 0, WORLDS - 1)


def _draw_ground(rng: np.random.Generator) -> Arguments:
    road, verge = str(rng.choice(ASPHALTS, p=_ASPHALT_SHARES)), str(rng.choice(VERGES, p=_VERGE_SHARES))
    return {
        "asphalt": (road, int(rng.integers(TILES))),
        "verge": (verge, int(rng.integers(TILES))),
        "asphalt_grey": float(rng.uniform(*_ASPHALT_GREYS[road])),
        "asphalt_contrast": float(rng.uniform(*_ASPHALT_CONTRASTS[road])),
        "verge_grey": float(rng.uniform(*_VERGE_GREYS[verge])),
        "verge_contrast": float(rng.uniform(0.5, 1.5)),
    }


def _draw_markings(rng: np.random.Generator) -> Arguments:
    return {
        "paint_grey": float(rng.uniform(150.0, 232.0)),
        "line_width": float(rng.uniform(0.10, 0.20)),
        "dash": _DASHES[int(rng.integers(len(_DASHES)))],
        "lane_width": _LANE_WIDTHS[int(rng.integers(len(_LANE_WIDTHS)))],
    }


def _draw_surroundings(rng: np.random.Generator) -> Arguments:
    horizon = float(rng.uniform(155.0, 285.0))  # a bright sky is beyond white
    return {
        "skyline": int(rng.integers(SKYLINES)),
        "hill_scale": float(rng.uniform(0.0, 2.0)),
        "tree_scale": float(np.exp(rng.uniform(np.log(0.5), np.log(4.0)))),
        "greys": (
            horizon * float(rng.uniform(0.55, 0.95)), horizon, float(rng.uniform(90.0, 150.0)),
            float(rng.uniform(24.0, 84.0)),
        ),
        "leaf_contrast": float(rng.uniform(4.0, 16.0)),
        "roadside": float(rng.uniform(0.0, 2.0)),
        "guard_rail": bool(rng.random() < 0.25),
    }  # fmt: skip


def _draw_sun(rng: np.random.Generator) -> Arguments:
    overcast = rng.random() < _OVERCAST_SHARE
    share = 0.0 if overcast else float(rng.uniform(0.45, 0.85))
    return {
        "sun_azimuth_deg": float(rng.uniform(0.0, 360.0)),
        "sun_elevation_deg": float(rng.uniform(18.0, 62.0)),
        "sun_share": share,
        "beam": float(rng.uniform(0.5, 1.4)),
        "street_light": float(np.exp(rng.uniform(np.log(0.002), np.log(0.08)))),
        # Display-coded, 0.49 to 0.58 of the road's grey was measured on a real overcast road, and 0.41 to
        # 0.85 in a tunnel; light is the square of the display code.
        "under_body": float(rng.uniform(0.62, 0.80)),
    }


def _draw_camera(rng: np.random.Generator) -> Arguments:
    return {
        "mount_height_error": float(rng.uniform(-0.1, 0.1)),
        "pitch_error_deg": float(rng.uniform(-0.5, 0.5)),
        "yaw_error_deg": float(rng.uniform(-0.5, 0.5)),
        # Dash cameras filter noise in time, and their compression removes most of the rest.
        "noise": float(np.exp(rng.uniform(np.log(0.12), np.log(1.2)))),
        "exposure_grey": float(rng.uniform(84.0, 122.0)),
        "exposure_s": float(rng.uniform(0.2, 1.0)),
        "night_exposure": float(rng.uniform(0.22, 0.9)),
        # Cameras render pictures with more contrast than the scene, with clipped shadows (ISO 22028-1 calls
        # such pictures output-referred).
        "contrast": float(rng.uniform(1.0, 1.55)),
    }
