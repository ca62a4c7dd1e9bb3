"""The first contact of an ego that does not brake."""

from math import cos, sin

from lgmd_gym.envs import BrakingEnv

EGO_LENGTH, EGO_WIDTH = 4.3, 1.8  # [m]
ADULT_HIP, CHILD_HIP, CRANK = 0.30 - 0.36, 0.711 / 2 - 0.396, 0.62 - 0.605  # ahead of the centre [m]


class Contact:
    """Ego and target at the first contact of an ego that does not brake."""

    def __init__(self, scenario):
        env = BrakingEnv(scenario)
        env.reset(seed=0)
        done = False
        while not done:
            *_, terminated, truncated, self.info = env.step([0.0])
            done = terminated or truncated
        self.ego = env.ego
        index = int(env.simulation.state.episodes["target"][0])
        self.target = env.road.items[index]
        self.touched = int(env.simulation.state.episodes["touched"][0]) == index
        self.travelled = env.ego.travelled

    def from_front(self, ahead, aside):
        """Return a point of the target relative to the middle of the ego's front: ahead and to the left [m].

        Args:
            ahead: Distance of the point ahead of the target's centre along the target's heading [m].
            aside: Distance to the left of the target's centreline [m].
        """
        heading = self.target.heading
        x = self.target.position[0] + ahead * cos(heading) + aside * sin(heading) - self.ego.position[0]
        y = self.target.position[1] + ahead * sin(heading) - aside * cos(heading) - self.ego.position[1]
        c, s = cos(self.ego.heading), sin(self.ego.heading)
        return x * c + y * s - EGO_LENGTH / 2, x * s - y * c
