"""Bodies of entities, and of their trailers."""

from dataclasses import dataclass

from lgmd_gym.errors import check_known, check_whole
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import Catalogs

SHADE = "lgmd_gym.shade"
"""Property of an entity: the grey level of the actor."""
KIND = "lgmd_gym.kind"
"""Property of an entity: the kind of the actor, where the category does not define it."""
_VEHICLES = {
    "car": "car",
    "van": "car",
    "truck": "car",
    "bus": "car",
    "bicycle": "bicycle",
    "motorbike": "motorcycle",
    "tram": "box",
    "train": "box",
    "trailer": "box",
    "semitrailer": "box",
}
_PEDESTRIANS = {"pedestrian": "pedestrian", "wheelchair": "pedestrian", "animal": "box"}
_FLAT = ("crosswalk", "patch", "roadMark", "parkingSpace")
_OWN = ("ego", "car", "box", "road_marking", "pedestrian", "bicycle", "motorcycle")


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityBody:
    """Size and kind of an entity."""

    kind: str  # kind of actor, see `Actor`
    length: float  # length [m]
    width: float  # width [m]
    height: float  # height [m]
    reference: float  # distance of the centre ahead of the reference point, the rear axle of a vehicle [m]
    wheelbase: float = 0.0  # distance between the axles [m]; 0 without axles
    shade: int | None = None  # grey level; None for a random one


@dataclass(frozen=True)
class Trailer:
    """A trailer of a vehicle or of the trailer before it."""

    item: Element  # element of the file
    name: str
    body: EntityBody
    hitch: float  # distance of the hitch ahead of the reference point of what pulls it [m]
    coupler: float  # distance of its coupler ahead of its own reference point, the axle [m]


def read_body(item: Element) -> EntityBody:
    """Return the body of an entity or of a trailer."""
    box = item.child("BoundingBox")
    centre, size = box.child("Center"), box.child("Dimensions")
    if centre.number("y", 0.0) != 0.0:
        raise centre.error("a bounding box beside the centreline is not supported; use y=0")
    properties = item.properties()
    with item.locate_errors():
        kind = check_known(KIND, properties.get(KIND, _kind(item)), _OWN)
        shade = None if SHADE not in properties else check_whole(SHADE, float(properties[SHADE]), 0, 255)
    return EntityBody(
        kind=kind,
        length=size.number("length"),
        width=size.number("width"),
        height=size.number("height"),
        reference=centre.number("x"),
        wheelbase=_wheelbase(item),
        shade=shade,
    )


def _kind(item: Element) -> str:
    if item.tag == "Vehicle":
        return _VEHICLES[item.choice("vehicleCategory", tuple(_VEHICLES))]
    if item.tag == "Pedestrian":
        return _PEDESTRIANS[item.choice("pedestrianCategory", tuple(_PEDESTRIANS))]
    return "road_marking" if item.text("miscObjectCategory") in _FLAT else "box"


def _wheelbase(item: Element) -> float:
    axles = item.find("Axles")
    if axles is None:
        return 0.0
    positions = [axle.number("positionX") for axle in axles.all("FrontAxle", "RearAxle")]
    return max(positions) - min(positions) if len(positions) > 1 else 0.0


def read_trailers(item: Element, catalogs: Catalogs) -> tuple[Trailer, ...]:
    """Return the trailers of a vehicle, in their order; a `TrailerRef` without a name is none."""
    block = item.find("Trailer")
    if block is None:
        return ()
    found = block.only("TrailerRef", "Trailer")
    if found.tag == "TrailerRef":
        if found.text("entityRef"):
            raise found.error("a trailer that is an entity is not supported; put it into the vehicle")
        return ()
    vehicle = catalogs.resolve(found, "Vehicle")
    hitch, coupler = item.child("TrailerHitch").number("dx"), vehicle.child("TrailerCoupler")
    if coupler.number("dx") <= 0.0:
        raise coupler.error(f"TrailerCoupler dx must be > 0 m, got {coupler.number('dx'):g}")
    trailer = Trailer(found, found.text("name"), read_body(vehicle), hitch, coupler.number("dx"))
    return (trailer, *read_trailers(vehicle, catalogs))
