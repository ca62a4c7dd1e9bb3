"""`Camera`: optics, mount, gaze and sensor of a camera on a car, and the presets."""

import math
from collections.abc import Mapping
from typing import TypeAlias, cast

from lgmd_gym.errors import check_known, check_size, shown
from lgmd_gym.fields import Record, choice, flag, number, optional, record, text, value

BIRDSEYE = "birdseye"
"""Name of the camera for highway-env's top view."""
MAX_WIDTH = 4096
"""Maximum width and height of a frame [px]."""
MIN_STOP = 4.0
"""Least stopping distance of the gaze `ToStoppingPoint` [m]."""
GYROSCOPE = "gyroscope"


@record
class Mount(Record):
    """Place and direction of a lens on the car."""

    label = "camera mount"

    height_m: float = number(1.2, "(0, 100]", "m", "Height of the lens above the ground.")
    setback_m: float = number(1.7, "[-10, 50]", "m", "Distance of the lens behind the front bumper.")
    left_m: float = number(0.0, "[-10, 10]", "m", "Distance of the lens left of the car's centreline.")
    pitch_deg: float = number(
        0.0, "[-60, 60]", "degrees", "Upward tilt of the optical axis; 0 puts the horizon at half height."
    )
    yaw_deg: float = number(
        0.0, "[-360, 360]", "degrees", "Yaw of the optical axis, + to the right; 0 is straight ahead."
    )
    calibrated: bool = flag(
        False, "Whether the sensor knows the errors of its mount up to a tenth, see `pose.CALIBRATED`."
    )


class Gaze(Record):
    """Base class of gazes: how the lens turns on the car.

    Attributes:
        kind: Name of the gaze: "fixed", "path" or "stopping".
        derotated: Whether rotations of the car cause no motion in the input of the neuron.
        brake_known: Whether the gaze uses the car's estimate of its full braking.
    """

    __slots__ = ()
    label = "camera gaze"
    kind: str = ""
    derotated: bool = False
    brake_known: bool = False


_DEROTATED = (
    "Whether the rotation of the car about the vertical axis, from its yaw rate, and that of the gaze cause "
    "no motion in the input of the neuron: the view turns by whole pixels, and the state of the neuron is "
    "shifted by as many (`FrameNeuron.step`)."
)


@record
class Fixed(Gaze):
    """Gaze that is fixed to the car."""

    kind: str = choice("fixed", ("fixed",), "Name of the gaze.")
    derotated: bool = flag(False, _DEROTATED)


@record
class AlongPath(Gaze):
    """Gaze towards the car's position in one second on its present circle, from speed and steering angle."""

    kind: str = choice("path", ("path",), "Name of the gaze.")
    derotated: bool = flag(False, _DEROTATED)


@record
class ToStoppingPoint(Gaze):
    """Gaze and zoom to the point of the car's present circle at `reach` stopping distances, see `pose`."""

    kind: str = choice("stopping", ("stopping",), "Name of the gaze.")
    reach: float = number(1.0, "[0.1, 10]", "", "Distance of the aim as a multiple of the stopping distance.")
    span_m: float = number(
        2.4, "[0.1, 100]", "m", "Width of the frame at that distance; replaces the field of view."
    )
    offset_m: float = number(0.0, "[-50, 50]", "m", "Distance of the aim left of the ego's path.")
    lift: float = number(
        0.0,
        "[-5, 5]",
        "",
        "Elevation of the optical axis, as a multiple of the angle from the horizon down to the aim.",
    )
    deceleration: float = number(
        7.5,
        "[0.5, 12]",
        "m/s²",
        "Deceleration of the stopping distance on a dry road; two thirds of it on a wet one. The least of "
        "all worlds is 7.5.",
    )
    reaction_s: float = number(0.5, "[0, 3]", "s", "Time from a demand to full braking.")
    brake_known: bool = flag(
        False,
        "Whether the stopping distance follows the car's estimate of its full braking: its deceleration is "
        "then `deceleration` times that estimate over 9 m/s², on any road. See `pose.known_deceleration`, "
        "also the observation `known_deceleration`.",
    )


GAZES: dict[str, type[Gaze]] = {"fixed": Fixed, "path": AlongPath, "stopping": ToStoppingPoint}
"""Gazes by kind."""


def make_gaze(gaze: object) -> Gaze:
    """Return a gaze from an instance, its kind, or a mapping of its kind and fields.

    Raises:
        ValueError: For another type, an unknown kind or field, or a value out of range.
    """
    if isinstance(gaze, Gaze):
        return gaze
    fields = {"kind": gaze} if isinstance(gaze, str) else gaze
    if not isinstance(fields, Mapping):
        raise ValueError(f"camera gaze must be one of {', '.join(GAZES)}, or a dict, got {shown(gaze)}")
    kind = check_known("camera gaze", cast(Mapping[str, object], fields).get("kind", "fixed"), GAZES)
    return GAZES[kind].make(cast(Mapping[str, object], fields))


@record
class ImageSensor(Record):
    """Sensor of a camera: noise, exposure and tone."""

    label = "camera sensor"

    shot_noise: float = number(
        0.0,
        "[0, 10]",
        "grey levels",
        "Standard deviation of photon noise at grey 128, growing with √grey; the weather and the world may "
        "raise it.",
    )
    read_noise: float = number(
        0.0,
        "[0, 50]",
        "grey levels",
        "Standard deviation of the read noise; the weather and the world may raise it.",
    )
    shutter_s: float = number(
        0.0,
        "[0, 0.1]",
        "s",
        "Exposure time, which ends at the time of the frame; 0 disables motion blur. Automotive cameras that "
        "must capture 90 Hz pulsed lights expose for 0.011 s or more by day.",
    )
    linear_light: bool = flag(
        False,
        "Whether the scene is in linear light (255 is white), which the sensor encodes with a square-root "
        "curve: grey = 255·√(light / 255). Noise is added to the light; its stated standard deviation is "
        "that at grey 128, and photon noise then has it at every grey. Always in numbered worlds.",
    )
    auto_exposure_s: float = number(
        0.0,
        "[0, 60]",
        "s",
        "Time constant of the gain that brings the mean of the frames before to grey 110; the first frame of "
        "an episode has its own gain. 0 disables it in the laboratory and selects that of the world in "
        "worlds. The gain is 1/4 to 8 by day and 1 to 24 at night.",
    )
    contrast_s: float = number(
        0.0,
        "[0, 60]",
        "s",
        "Time constant of a contrast control, which brings the standard deviation of the frames before to 25 "
        "grey levels with a gain of 0.5 to 3, and their mean to 110; 0 disables it. Fog and a dark road then "
        "weaken the responses of a neuron less, and a bright skyline raises them less.",
    )


@record
class Camera(Record):
    """A camera on a car.

    Pixels per degree at the centre of the frame: `wide` 2.4, `standard` 3.8, `tele` 6.3, `fovea` 16.0,
    `paper` 5.3. `fovea` (160 px over 10°) matches the centre of a production 8-megapixel 120° front camera
    (3840 px / 120° = 32 px/°) after 2 × 2 binning.
    """

    label = "camera"

    name: str = text("custom", "Name of the camera.")
    shape: tuple[int, int] = value(
        (90, 160),
        lambda name, size: check_size(name, size, 4, MAX_WIDTH),
        "`(height, width)` of the frame [px], each 4 to 4096",
    )
    hfov_deg: float = number(60.0, "(1, 170)", "degrees", "Horizontal field of view.")
    mount: Mount = value(Mount(), lambda _, mount: Mount.make(mount), "Place and direction on the car.")
    gaze: Gaze = value(Fixed(), lambda _, gaze: make_gaze(gaze), "How the lens turns on the car.")
    sensor: ImageSensor = value(
        ImageSensor(), lambda _, sensor: ImageSensor.make(sensor), "Noise, exposure and tone."
    )
    stabiliser: str | None = optional(
        choice(
            None,
            (GYROSCOPE,),
            "Compensation of the rotation of the body; the errors of the gyroscope are assumptions, see "
            "`body_motion.residual_motion`.",
        )
    )

    def check(self) -> None:
        """Check the name, and the zoom of the gaze `ToStoppingPoint`."""
        if not self.name:
            raise ValueError("camera name must not be empty")
        if self.name == BIRDSEYE:
            raise ValueError(f"camera name {BIRDSEYE!r} is that of highway-env's top view; use `BirdsEye`")
        if isinstance(self.gaze, ToStoppingPoint) and self.gaze.span_m > 4.0 * self.least_depth_m:
            raise ValueError(
                f"camera span_m must be at most {4.0 * self.least_depth_m:.3g} m, four times the least "
                f"distance of the aim from the lens, got {self.gaze.span_m:g}; reduce span_m or "
                "increase reach"
            )

    @property
    def least_depth_m(self) -> float:
        """Least distance of the aim of the gaze `ToStoppingPoint` from the lens [m]; infinite for others."""
        if isinstance(self.gaze, ToStoppingPoint):
            return MIN_STOP * self.gaze.reach + self.mount.setback_m
        return math.inf

    @property
    def focal_px(self) -> float:
        """Focal length [px], equal to the pixels per radian at the centre of the frame."""
        return 0.5 * self.shape[1] / math.tan(math.radians(0.5 * self.hfov_deg))

    @property
    def pixels_per_degree(self) -> float:
        """Pixels per degree at the centre of the frame."""
        return self.focal_px * math.pi / 180.0

    @classmethod
    def presets(cls) -> Mapping[str, "Camera"]:
        """Return the cameras that `make` accepts by name; "wide" is the default.

        Example:
            >>> Camera.make("fovea", mount={"height_m": 1.4}).hfov_deg
            10.0
        """
        return PRESETS


CameraItem: TypeAlias = str | Camera | Mapping[str, object]
"""One camera: the name of a preset, a `Camera`, or a mapping of its fields."""

PRESETS: dict[str, Camera] = {
    "wide": Camera(name="wide", hfov_deg=60.0),
    "standard": Camera(name="standard", hfov_deg=40.0),
    "tele": Camera(name="tele", hfov_deg=25.0),
    "fovea": Camera(name="fovea", hfov_deg=10.0),
    "paper": Camera(name="paper", hfov_deg=60.0, shape=(288, 352)),
}
"""Cameras by name; `paper` has the frame size of the paper's clips."""
