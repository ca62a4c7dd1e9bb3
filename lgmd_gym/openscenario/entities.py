"""Entities: the bodies of vehicles, pedestrians and objects, and their motion."""

from dataclasses import dataclass, field
from math import pi

from lgmd_gym.errors import check_known, check_whole
from lgmd_gym.openscenario.catalogs import Catalogs
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.paths import Place, Track
from lgmd_gym.openscenario.timelines import Timeline

CONTROL_POINT = "Driver.ControlPoint.Mode"  # property of a controller, Vector DYNA4
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
class Body:
    """Size and kind of an entity.

    Attributes:
        kind: Kind of actor, see `Actor`.
        length: Length [m].
        width: Width [m].
        height: Height [m].
        reference: Distance of the centre ahead of the reference point, the rear axle of a vehicle [m].
        wheelbase: Distance between the axles [m]; 0 without axles.
        shade: Grey level; None for a random one.
    """

    kind: str
    length: float
    width: float
    height: float
    reference: float
    wheelbase: float = 0.0
    shade: int | None = None


@dataclass(slots=True)
class Mover:
    """An entity in motion.

    Attributes:
        name: Name in the scenario.
        body: Its body.
        track: Path of its reference point from its start; None before it is placed.
        start: Pose of its reference point at the start; None before it is placed.
        follows: Whether it follows a trajectory or route.
        timeline: Its speed; distances count from the start.
        backwards: Whether it drives backwards along its track.
        front_axle: Whether the front axle follows trajectories.
        leader: Entity whose speed it copies.
        deleted: Whether it has been deleted at the start.
    """

    name: str
    body: Body
    track: Track | None = None
    start: Place | None = None
    follows: bool = False
    timeline: Timeline = field(default_factory=Timeline)
    backwards: bool = False
    front_axle: bool = False
    leader: "Mover | None" = None
    deleted: bool = False

    def place(self, time: float = 0.0) -> Place:
        """Return the pose of the reference point at a time [s].

        Raises:
            ValueError: If the entity has no position.
        """
        if self.track is None:
            raise ValueError(f"entity {self.name!r} has no position; add a TeleportAction to Init")
        place = self.track.at(self.timeline.at(time).distance)
        return place.turned(pi) if self.backwards else place

    @property
    def front(self) -> float:
        """Distance from the reference point to the front [m]."""
        return self.body.reference + self.body.length / 2

    @property
    def rear(self) -> float:
        """Distance from the reference point to the rear, + backwards [m]."""
        return self.body.length / 2 - self.body.reference


def read_entities(scenario: Element, catalogs: Catalogs) -> dict[str, Mover]:
    """Return the entities of a scenario by name.

    Raises:
        ValueError: If an entity is not supported.
    """
    movers = {}
    for item in scenario.child("Entities").all("ScenarioObject"):
        name = item.text("name")
        found = catalogs.resolve(item, "Vehicle", "Pedestrian", "MiscObject")
        mover = Mover(name, _body(found))
        for controller in item.all("ObjectController"):
            mover.front_axle = reads_front_axle(controller, catalogs)
        movers[name] = mover
    return movers


def reads_front_axle(item: Element, catalogs: Catalogs) -> bool:
    """Return whether the `Controller` of an element moves the control point to the front axle.

    Raises:
        ValueError: If the controller has a property that is not supported.
    """
    if not item.node.children:
        return False
    controller = catalogs.resolve(item, "Controller")
    front_axle = False
    for name, value in _properties(controller).items():
        if name != CONTROL_POINT or value not in ("FrontAxle", "RearAxle"):
            raise controller.error(f"controller property {name}={value!r} is not supported; remove it")
        front_axle = value == "FrontAxle"
    return front_axle


def _body(item: Element) -> Body:
    box = item.child("BoundingBox")
    centre, size = box.child("Center"), box.child("Dimensions")
    if centre.number("y", 0.0) != 0.0:
        raise centre.error("a bounding box beside the centreline is not supported; use y=0")
    properties = _properties(item)
    try:
        kind = check_known(KIND, properties.get(KIND, _kind(item)), _OWN)
        shade = None if SHADE not in properties else check_whole(SHADE, float(properties[SHADE]), 0, 255)
    except ValueError as error:
        raise item.error(str(error)) from None
    return Body(
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


def _properties(item: Element) -> dict[str, str]:
    block = item.find("Properties")
    return (
        {} if block is None else {entry.text("name"): entry.text("value") for entry in block.all("Property")}
    )
