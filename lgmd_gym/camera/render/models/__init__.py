"""The models of all drawable objects as tables of polygons."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.effects import WHITE
from lgmd_gym.camera.render.models.builder import BODY, ModelBuilder
from lgmd_gym.camera.render.models.figures import FigureTables, figure_tables
from lgmd_gym.camera.render.models.roadside import (
    add_barrier,
    add_beam,
    add_board,
    add_crown,
    add_deck,
    add_hedge,
    add_house,
    add_lamp,
    add_panel,
    add_plain_box,
    add_post,
    add_power_pole,
    add_rail,
    add_sign,
    add_signal,
    add_thicket,
    add_tree,
    add_truck,
    add_wall,
)
from lgmd_gym.camera.render.models.vehicles import SMALL, SUV, VAN, add_body, add_bus, add_car, add_trailer

_MAX_CORNERS = 8


class Models(NamedTuple):
    """Polygons of all models; see `ModelBuilder` for the terms."""

    # anticlockwise from outside, and the first one again for unused places, float64, shape (polygons, 3, 8)
    corners: np.ndarray
    corners_used: np.ndarray  # number of corners, int64, shape (polygons,)
    parent: np.ndarray  # index of a detail's face, -1 for a face, int64, shape (polygons,)
    role: np.ndarray  # BODY, FIXED, TAIL or LAMP, int64, shape (polygons,)
    value: np.ndarray  # meaning depends on the role, float64, shape (polygons,)
    # apparent height of the object at which a detail starts to fade in; it is complete at twice that height,
    # float64, shape (polygons,) [px]
    fine: np.ndarray
    solids: np.ndarray  # first and last + 1 polygon of each solid, int64, shape (solids, 2)
    models: np.ndarray  # first and last + 1 solid of each model, int64, shape (models, 2)
    # height from below which the solids of a model are drawn in reverse, as a share of its height, float64,
    # shape (models,)
    splits: np.ndarray
    # distance of a model's headlights from its middle as a share of its width, 0 for one lamp that shines in
    # all directions, below 0 for one headlight, and their height as a share of its height, 0 for none,
    # float64, shape (models, 2)
    lamps: np.ndarray
    figures: FigureTables  # tables of the models that have no solids: pedestrians and two-wheelers


@lru_cache(maxsize=2)
def all_models(linear: bool) -> Models:
    """Return the tables of all models, in the order of `objects.MODEL_…`.

    Args:
        linear: Whether values are light, proportional to the square of the display code.
    """
    b = ModelBuilder()
    add_car(b)
    add_truck(b)
    add_plain_box(b)
    add_plain_box(b)  # MODEL_MARK is never drawn as a solid; this entry keeps the numbering
    add_barrier(b)
    add_rail(b)
    add_post(b)
    add_tree(b)
    add_crown(b)
    for shape in (SMALL, SUV, VAN):
        add_body(b, shape)
    add_trailer(b)
    add_bus(b)
    for add in (add_beam, add_deck, add_panel, add_board, add_signal):
        add(b)
    for corners in (8, 3, 4):
        add_sign(b, corners)
    for add in (add_power_pole, add_wall, add_hedge, add_house, add_lamp, add_thicket):
        add(b)
    for lamps in ((0.0, 0.0), (0.0, 0.0), (-1.0, 0.6)):  # a motorcycle has one headlight
        b.model(lamps=lamps)
    corners = np.zeros((len(b.corners), 3, _MAX_CORNERS))
    for index, points in enumerate(b.corners):
        corners[index] = np.transpose([*points, *[points[0]] * (_MAX_CORNERS - len(points))])
    return Models(
        corners,
        corners_used=np.array([len(points) for points in b.corners], dtype=np.int64),
        parent=np.array(b.parent, dtype=np.int64),
        role=np.array(b.role, dtype=np.int64),
        value=_light_of(b) if linear else np.array(b.value, dtype=np.float64),
        fine=np.array(b.fine, dtype=np.float64),
        solids=np.array(b.solids),
        models=np.array(b.models),
        splits=np.array(b.splits),
        lamps=np.array(b.lamps),
        figures=figure_tables(linear),
    )


def most_polygons(models: Models) -> int:
    """Return the largest number of polygons of a model."""
    sizes = models.solids[:, 1] - models.solids[:, 0]
    return max(int(sizes[first:last].sum()) for first, last in models.models)


def _light_of(b: ModelBuilder) -> np.ndarray:
    """Return the values of all polygons as light: multiples of the body's light, or light up to 255."""
    value = np.array(b.value, dtype=np.float64)
    return value * value / np.where(np.array(b.role) == BODY, 1.0, WHITE)
