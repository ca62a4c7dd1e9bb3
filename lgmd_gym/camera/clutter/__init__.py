"""What stands beside, over and on a road besides vehicles: signs, bridges, houses, patches of tar."""

from lgmd_gym.camera.clutter.place import place_clutter
from lgmd_gym.camera.clutter.settings import ROAD_TYPES, Clutter, draw_clutter

__all__ = ["ROAD_TYPES", "Clutter", "draw_clutter", "place_clutter"]
