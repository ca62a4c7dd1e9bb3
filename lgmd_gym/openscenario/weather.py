"""The weather of an `Environment`."""

from lgmd_gym.camera import CLEAR
from lgmd_gym.openscenario.nodes import Element

NIGHT_LUX = 50.0
"""Illuminance of the sun below which it is night; twilight of a street is about 10 lx, a dull day 1000 lx."""
FOG = 1000.0  # [m], visual range below which the weather is fog, as in meteorology


def weather_of(environment: Element | None) -> str:
    """Return the weather of an `Environment`: clear, night, fog or rain.

    Night is a sun below 50 lx, fog a visual range below 1000 m, rain a precipitation with an intensity.
    """
    if environment is None:
        return CLEAR
    found = set[str]()
    road = environment.find("RoadCondition")
    if road is not None and road.number("frictionScaleFactor") != 1.0:
        raise road.error("frictionScaleFactor must be 1: the brake belongs to the world")
    weather = environment.find("Weather")
    if weather is None:
        return CLEAR
    sun, fog, rain = (weather.find(tag) for tag in ("Sun", "Fog", "Precipitation"))
    if sun is not None and _illuminance(sun) < NIGHT_LUX:
        found.add("night")
    if fog is not None and fog.number("visualRange") < FOG:
        found.add("fog")
    if rain is not None and rain.choice("precipitationType", ("dry", "rain")) == "rain":
        intensity = "precipitationIntensity" if rain.has("precipitationIntensity") else "intensity"
        found |= {"rain"} if rain.number(intensity) > 0.0 else set()
    if len(found) > 1:
        raise weather.error(f"the weathers {', '.join(sorted(found))} cannot be combined; use one")
    return found.pop() if found else CLEAR


def _illuminance(sun: Element) -> float:
    """Return the illuminance of the sun [lx]; `intensity` is its name in OpenSCENARIO 1.1."""
    for name in ("illuminance", "intensity"):
        if sun.has(name):
            return sun.number(name)
    raise sun.error("Sun needs the attribute 'illuminance'")
