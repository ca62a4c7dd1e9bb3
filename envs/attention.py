"""Drivers who err: an ego driver who looks away, a car ahead that brakes, a car behind that reacts late.

highway-env's drivers observe all cars at all times and react at once, so that they hardly ever need an
emergency brake. An `Attention` adds the errors that precede most rear-end contacts.

- **Looking away**: in a window the ego's driver holds the acceleration demanded at its start, and steers on.
  The windows of 2 to 4 s are the long glances that double the risk of a contact (Klauer et al. 2006, DOT HS
  810 594: glances of more than 2 s). Two rules keep the held pedal physical: a car at the speed limit of its
  lane does not accelerate, and a car that stands does not start. Braking by the agent does not end a window.
- **A car ahead that brakes**: in a window, the car that is ahead of the ego in its lane at the start of the
  window decelerates by at least a given value, whatever is ahead of it.
- **Late reaction**: the driver of the car behind the ego in its lane only lifts the throttle, 1 m/s², until
  a stronger deceleration has been required for the reaction time; then the car brakes, if required as hard as
  the ego's brake can. 1 s is between the 0.7 s of expected and the 1.25 s of surprising brake lights (Green
  2000, Transportation Human Factors 2, 195-216). A car that keeps its lane starts behind the ego, where
  there is room. With these values it drives into the ego in a quarter of its full stops from motorway speed.

The windows are drawn when the episode begins, from a random generator that nothing else uses. They depend on
the seed alone: they are the same whatever an agent does, and for every duration of the episode. They are more
frequent than on real roads, so that 100 km contain threats; contacts per distance are therefore none of real
roads.
"""

from collections.abc import Mapping
from typing import ClassVar

from lgmd_gym.errors import shown
from lgmd_gym.fields import Record, flag, number, numbers, record

INATTENTIVE = "inattentive-"
"""What precedes a kind of traffic with drivers who err, where training names kinds."""


@record
class Attention(Record):
    """Errors of the drivers around the ego and of its own driver; the default has none."""

    label: ClassVar[str] = "attention"
    glance_interval: float = number(
        float("inf"),
        "[1, inf]",
        "s",
        "Mean time between two windows in which the ego's driver looks away; `inf` for none.",
    )
    glance_durations: tuple[float, float] = numbers(
        (2.0, 4.0), "[0.1, 20]", "s", "Shortest and longest of these windows, drawn uniformly."
    )
    braking_interval: float = number(
        float("inf"),
        "[1, inf]",
        "s",
        "Mean time between two windows in which the car ahead brakes; `inf` for none.",
    )
    braking_durations: tuple[float, float] = numbers(
        (1.0, 3.0), "[0.1, 20]", "s", "Shortest and longest of these brakings, drawn uniformly."
    )
    decelerations: tuple[float, float] = numbers(
        (3.0, 8.0), "[0, 12]", "m/s²", "Weakest and strongest of these brakings, drawn uniformly."
    )
    reaction_time: float = number(
        0.0, "[0, 5]", "s", "Time after which the driver behind the ego begins to brake."
    )
    follower: bool = flag(
        False,
        "Whether a car that keeps its lane starts behind the ego, where there is room.",
    )

    def check(self) -> None:
        """Raise ValueError if a range is reversed."""
        for name in ("glance_durations", "braking_durations", "decelerations"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"attention {name} must be in ascending order, got {shown((low, high))}")

    @property
    def errs(self) -> bool:
        """Whether any driver errs."""
        return self != PRESETS["attentive"]

    @classmethod
    def presets(cls) -> Mapping[str, "Attention"]:
        """Return "attentive", the default without errors, and "inattentive"."""
        return PRESETS


PRESETS = {
    "attentive": Attention(),
    "inattentive": Attention(glance_interval=10.0, braking_interval=10.0, reaction_time=1.0, follower=True),
}
