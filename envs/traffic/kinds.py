# pyright: standard
# Not strict: highway-env states few types.
"""The kinds of traffic, each based on a highway-env environment."""

from typing import ClassVar, cast

from highway_env.envs.highway_env import HighwayEnv
from highway_env.envs.intersection_env import IntersectionEnv
from highway_env.envs.merge_env import MergeGenericEnv
from highway_env.envs.roundabout_env import RoundaboutEnv
from highway_env.envs.two_way_env import TwoWayEnv

from lgmd_gym.aliases import Config
from lgmd_gym.envs.traffic.cars import TrafficCar
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.envs.traffic.lanes import HighwayLane
from lgmd_gym.envs.traffic.road import TrafficRoad


class HighwayTraffic(TrafficEnv, HighwayEnv):
    """A three-lane highway with slower cars ahead and three faster cars behind, which cut in."""

    settings: ClassVar[Config] = {"lanes_count": 3, "vehicles_count": 11}

    def _modify_scene(self) -> None:
        for number in range(3):
            lane = self.road.network.get_lane(("0", "1", int(self.np_random.integers(3))))
            behind = 35.0 * (number + self.np_random.uniform(0.8, 1.2))
            distance = lane.local_coordinates(self.ego.position)[0] - behind
            speed = self.np_random.uniform(25.0, 29.0)
            self.road.cars.append(TrafficCar(self.road, lane.position(distance, 0.0), speed=speed))


class MergeTraffic(TrafficEnv, MergeGenericEnv):
    """A motorway with an access ramp from which a car merges next to the ego."""

    settings: ClassVar[Config] = {"vehicles_count": 8, "after_merge_length": 500}

    def _modify_scene(self) -> None:
        for car in self.road.cars:
            if car is not self.ego and car.lane_index[0] == "a":
                # In highway-env all cars drive at the speed limit, with constant distances.
                car.speed = car.target_speed = self.np_random.uniform(23.0, 30.0)

    def _is_finished(self) -> bool:
        return bool(self.ego.position[0] > self.end_position)


class TwoWayTraffic(TrafficEnv, TwoWayEnv):  # type: ignore[misc]
    """A two-way road with slower cars ahead and oncoming cars in the adjacent lane."""

    LENGTH: ClassVar[float] = 1500.0

    def _make_road(self, length: float = LENGTH) -> None:
        super()._make_road(length)  # type: ignore[arg-type]

    def _modify_scene(self) -> None:
        for car in self.road.cars:
            # At the end of the road the next lane would be the opposite one.
            car.continues_to_next_lane = False
            if car is not self.ego and car.lane_index[0] == "a":
                car.speed = car.target_speed = self.np_random.uniform(14.0, 19.0)
        lane = self.road.network.get_lane(("b", "a", 0))
        for number in range(7):
            distance = 450.0 + 130.0 * number + self.np_random.uniform(-50.0, 50.0)
            speed = self.np_random.uniform(15.0, 20.0)
            position, heading = lane.position(distance, 0.0), lane.heading_at(distance)
            car = TrafficCar(self.road, position, heading, speed, ("b", "a", 0), enable_lane_change=False)
            car.continues_to_next_lane = False
            self.road.cars.append(car)

    def _add_and_remove_cars(self) -> None:
        # Cars beyond the start of the road no longer react to others.
        self.road.cars[:] = [car for car in self.road.cars if car.position[0] > 0.0]

    def _is_finished(self) -> bool:
        return bool(self.ego.position[0] > self.LENGTH - 100.0)


class IntersectionTraffic(TrafficEnv, IntersectionEnv):
    """An intersection with highway-env's priority rules, where the ego turns or drives straight on."""

    regulated: ClassVar[bool] = True
    warm_up: ClassVar[float] = 0.0  # highway-env simulates 3 s before the episode
    settings: ClassVar[Config] = {
        "other_vehicles_type": "lgmd_gym.envs.traffic.cars.IntersectionCar",
        "destination": None,
        "initial_vehicle_count": 8,
        "spawn_probability": 0.35,
    }

    def _make_road(self) -> None:
        super()._make_road()
        self.road = TrafficRoad(self.road, None, self.regulated)  # highway-env simulates traffic on it

    def _modify_scene(self) -> None:
        self.ego.target_speed = self.ego.lane.speed_limit

    def _add_and_remove_cars(self) -> None:
        self._clear_vehicles()
        if self.steps % self.config["simulation_frequency"] == 0:  # once per second, as in highway-env
            self._spawn_vehicle(spawn_probability=self.config["spawn_probability"])

    def _is_finished(self) -> bool:
        return bool(self.has_arrived(self.ego, exit_distance=70.0))


class RoundaboutTraffic(TrafficEnv, RoundaboutEnv):
    """A two-lane roundabout with four arms; cars inside it have the right of way."""

    regulated: ClassVar[bool] = True
    warm_up: ClassVar[float] = 2.0

    def _make_road(self) -> None:
        super()._make_road()
        for lane in cast(list[HighwayLane], self.road.network.lanes_list()):
            lane.priority = int(hasattr(lane, "radius"))
            # At highway-env's limits of 16 to 20 m/s the lateral acceleration would exceed 1.3 g.
            lane.speed_limit = 12.0

    def _modify_scene(self) -> None:
        lane = self.road.network.get_lane(("ser", "ses", 0))
        distance = self.np_random.uniform(20.0, 70.0)  # highway-env places the ego directly at the entry
        self.ego.position, self.ego.heading = lane.position(distance, 0.0), lane.heading_at(distance)
        self.ego.plan_route_to(str(self.np_random.choice(["exr", "nxr", "wxr"])))
        for arm in ("eer", "ner", "wer"):
            start = self.road.network.get_lane((arm, arm[:2] + "s", 0))
            distance = self.np_random.uniform(0.0, 80.0)
            speed = self.np_random.uniform(8.0, 12.0)
            position, heading = start.position(distance, 0.0), start.heading_at(distance)
            car = TrafficCar(self.road, position, heading, speed)
            car.plan_route_to(str(self.np_random.choice(["exr", "sxr", "nxr", "wxr"])))
            self.road.cars.append(car)

    def _is_finished(self) -> bool:
        lane = self.ego.lane_index
        return bool(lane[1].endswith("xr") and self.ego.lane.local_coordinates(self.ego.position)[0] > 60.0)
