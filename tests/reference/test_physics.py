"""`BrakingEnv` against plain Python physics, for every family and for random demands."""

from math import cos, inf, sin

import numpy as np
import pytest
from reference.physics import PASSED_DISTANCE, Body, Ego, Motion

from lgmd_gym.envs import FAMILIES, BrakingEnv, make_scenario
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.script import Pose

pytestmark = pytest.mark.slow


class ReferenceEpisode:
    """A braking scenario from the start position of an environment."""

    def __init__(self, env):
        scenario, (x, y) = env.scenario, env.ego.position
        self.env = env
        self.ego = Ego(scenario, Pose(float(x), float(y), 0.0), env.brake, env.config["throttle"])
        actors = sorted(scenario.actors, key=lambda actor: actor.kind != "car")
        self.vehicles = [actor.kind in ("car", "motorcycle") for actor in actors]
        self.solid = [actor.kind != "road_marking" for actor in actors]
        self.bodies = []
        for actor in actors:
            centre = float(x) + scenario.ego_length / 2 + actor.gap + actor.length / 2
            pose = Pose(centre, float(y) - actor.lateral_offset, -actor.heading)
            size = actor.length, actor.width, actor.reference
            self.bodies.append(Body(pose, actor.path, actor.speed, actor.profile, *size))
        self.closed_in, self.contact, self.resolved = False, None, 0.0

    def step(self, demand):
        """Advance by one decision and return the reward."""
        config, ego = self.env.config, self.ego
        speed, acceleration = ego.speed, ego.acceleration
        ego.put(min(max(demand, -1.0), 1.0))
        for _ in range(config["simulation_frequency"] // config["policy_frequency"]):
            if self.contact is None:
                self.advance(1 / config["simulation_frequency"])
        return self.reward(speed, acceleration)

    def advance(self, dt):
        everything = [self.ego, *self.bodies]
        motions = [Motion(body, dt) for body in everything]
        for body in everything:
            body.step(dt)
        times = [motions[0].first_touch(motion) for motion in motions[1:]]
        found, touched = inf, None
        for time, body, solid in zip(times, self.bodies, self.solid, strict=True):
            if solid and time < found:
                found, touched = time, body
        if touched is None:
            return
        for motion, body, solid in zip(motions, everything, [True, *self.solid], strict=True):
            if solid:
                distance, speed = motion.progress(found)
                body.move(distance - motion.distance)
                body.speed = speed
        along = touched.speed * cos(touched.heading - self.ego.heading)
        self.contact = self.ego.speed, self.ego.speed - along

    def reward(self, speed, acceleration):
        ego, weights = self.ego, self.env.config["reward"]
        dt, scripted = 1.0 / self.env.config["policy_frequency"], self.env.scenario.top_speed
        full = ego.brake.max_deceleration
        total = weights["progress"] * dt * min((speed + ego.speed) / (2.0 * scripted), 1.0)
        total -= weights["jerk"] * abs(ego.acceleration - acceleration) / full
        if self.contact is not None:
            severity = min(self.contact[1] / scripted, 1.0)
            return total - weights["contact"] - weights["impact"] * severity**2
        if ego.braking > 0.0 and self.env.ttc >= weights["need_ttc"]:
            total -= weights["brake"] * dt * ego.braking / full
        return total

    def terminated(self):
        ego = self.ego
        if self.contact is not None:
            return True
        if ego.speed == 0.0:
            return self.follows_up(ego.script.speed > 0.0 and not self.approached())
        others = [body for body, solid in zip(self.bodies, self.solid, strict=True) if solid]
        left = [body for body in others if not self.passed(body)]
        self.closed_in = self.closed_in or any(ego.speed > self.along(body) for body in left)
        resolved = all(
            not body.script.left and body.path.straight and ego.speed < self.along(body) for body in left
        )
        if others and not left:
            return True
        return self.follows_up(bool(others) and self.closed_in and resolved)

    def follows_up(self, resolved):
        """Return whether the conflict has been resolved for the follow-up time."""
        self.resolved = self.resolved + 1 / self.env.config["policy_frequency"] if resolved else 0.0
        return self.resolved > self.env.config["follow_up"] - 1e-9

    def passed(self, body):
        ego = self.ego
        along = (body.x - ego.x) * cos(ego.heading) + (body.y - ego.y) * sin(ego.heading)
        return -along - (ego.length + body.length) / 2 > PASSED_DISTANCE and self.along(body) <= ego.speed

    def along(self, body):
        return body.speed * cos(body.heading - self.ego.heading)

    def approached(self):
        """Return whether a vehicle touches the standing ego, in steps of 1 ms at constant speed."""
        here = Rectangle(self.ego.x, self.ego.y, self.ego.heading, self.ego.length, self.ego.width)
        for body, vehicle in zip(self.bodies, self.vehicles, strict=True):
            for number in range(10_000 if vehicle and body.speed > 0.0 else 0):
                pose = body.centre(body.travelled + body.speed * 0.001 * number)
                if first_touch(here, Rectangle(*pose, body.length, body.width), 0.0, 0.0) == 0.0:
                    return True
        return False


@pytest.mark.parametrize("family", FAMILIES)
def test_every_step_equals_the_reference(family):
    rng = np.random.default_rng(len(family))
    configs = ({}, {"throttle": True, "policy_frequency": 20, "latency": 0.013, "build_up": 0.0})
    for number, config in enumerate(configs):
        env = BrakingEnv(make_scenario(family), config)
        env.reset(seed=number)
        reference, demand, ended = ReferenceEpisode(env), 0.0, False
        while not ended:
            if rng.random() < 0.1:
                demand = float(rng.choice([0.0, 0.0, -0.3, -1.0, 0.6]))
            _, reward, terminated, truncated, info = env.step(demand)
            env.ttc = info["ttc"]
            assert reward == pytest.approx(reference.step(demand), rel=1e-12, abs=1e-12)
            assert terminated == reference.terminated()
            shown = [env.ego, *(item for item in env.road.items[1:])]
            for item, body in zip(shown, [reference.ego, *reference.bodies], strict=True):
                found = (*item.position, item.heading, item.speed, item.acceleration)
                expected = (body.x, body.y, body.heading, body.speed, body.acceleration)
                assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
            impact = reference.contact or (inf, inf)
            assert (info["impact_speed"], info["relative_impact_speed"]) == pytest.approx(impact)
            assert info["deceleration"] == pytest.approx(reference.ego.braking, abs=1e-12)
            ended = terminated or truncated
