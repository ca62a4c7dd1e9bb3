"""Cars of the traffic environments: highway-env's IDM and MOBIL drivers with fixed parameters."""

from typing import Any

from highway_env.vehicle.behavior import IDMVehicle

from lgmd_gym.envs.traffic.lanes import LaneTable
from lgmd_gym.envs.traffic.places import NO_ROUTE, UNPLANNED

HEADWAYS = (0.4, 1.5)  # [s], IDM's time headway T; each driver draws one


class TrafficCar(IDMVehicle):
    """highway-env's IDM and MOBIL driver that never reverses and is not displaced by collisions.

    `TrafficRoad` computes the decisions and the motion of all cars.

    Each driver draws its time headway from the road's random generator: with highway-env's 1.5 s and 10 m for
    all, 95 % of the headways in following exceed 2 s, and traffic contains no close following.

    All other parameters are set in this class: `IntersectionEnv` changes the parameters of highway-env's
    classes for the rest of the process, and the traffic must not depend on previously created environments.

    Attributes:
        continues_to_next_lane: Whether the car continues on the next lane at the end of its lane; otherwise
            it drives straight on.
    """

    ACC_MAX = 6.0
    COMFORT_ACC_MAX = 3.0
    COMFORT_ACC_MIN = -5.0
    DISTANCE_WANTED = 7.0
    DELTA = 4.0
    HEIGHT = 1.5
    IS_EGO = False

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.TIME_WANTED = float(self.road.np_random.uniform(*HEADWAYS))
        self.collidable = False  # `TrafficRoad` finds contacts; highway-env's check would displace the cars
        self.impact = None  # highway-env's initial zero vector would count as a contact
        self.continues_to_next_lane = True

    @property
    def planned_lane(self) -> float:
        """Lane number at the head of the route, `UNPLANNED` or `NO_ROUTE`."""
        if not self.route:
            return NO_ROUTE
        number = self.route[0][2]
        return UNPLANNED if number is None else number

    def state(self, lanes: LaneTable) -> tuple[Any, ...]:
        """Return the values of `CAR_STATE`."""
        position: Any = self.position
        x, y = position.tolist()
        action: Any = self.action
        return (
            *(x, y, self.heading, self.speed, lanes.numbers[self.lane_index]),
            *(lanes.numbers[self.target_lane_index], self.timer, action["steering"], action["acceleration"]),
            *(self.crashed, self.target_speed, self.enable_lane_change, self.continues_to_next_lane),
            self.planned_lane,
        )

    @property
    def constants(self) -> tuple[Any, ...]:
        """The values of `CAR_CONSTANTS`."""
        return (
            *(self.IS_EGO, self.LENGTH, self.WIDTH, self.COMFORT_ACC_MAX, self.COMFORT_ACC_MIN),
            *(self.DISTANCE_WANTED, self.TIME_WANTED, self.DELTA, 2.0),
        )

    def predict_trajectory_constant_speed(self, times: Any) -> Any:
        """Return predicted positions and headings along the route at constant speed.

        highway-env's version uses the lane count of the wrong road and fails where a road has fewer lanes.

        Args:
            times: Prediction times from now on [s].
        """
        network, (start, end, number), lane = self.road.network, self.lane_index, self.lane
        along, covered = lane.local_coordinates(self.position)[0], 0.0
        route = [piece for piece in self.route or [] if piece[:2] != (start, end)]
        poses = []
        for time in times:
            place = along + self.speed * time - covered
            while place > lane.length and route:
                covered, place = covered + lane.length, place - lane.length
                start, end, next_number = route.pop(0)
                lanes = network.graph[start][end]
                lane = lanes[min(number if next_number is None else next_number, len(lanes) - 1)]
            poses.append((lane.position(place, 0.0), lane.heading_at(place)))
        return tuple(zip(*poses, strict=True))


class IntersectionCar(TrafficCar):
    """A `TrafficCar` with the driver parameters of `IntersectionEnv`."""

    COMFORT_ACC_MAX = 6.0
    COMFORT_ACC_MIN = -3.0
