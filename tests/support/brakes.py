"""A source of episodes that draws brakes."""

from lgmd_gym.benchmark import player
from lgmd_gym.engine import vector_env
from lgmd_gym.envs import registration
from lgmd_gym.envs.dynamics.brake import draw_brake


class DrawnBrakes:
    """The episodes of another source, each with the brake of a random world on a dry or wet road."""

    def __init__(self, source):
        self.source, self.first = source, source.first

    def draw(self, rng):
        draw = self.source.draw(rng)
        world = int(rng.integers(1000))
        return draw._replace(brake=draw_brake(world, world % 2 == 1))


def draw_all_brakes(monkeypatch):
    """Let every environment of a scenario family or of random levels draw its brake."""
    make_source = registration.make_source

    def drawing(*arguments):
        return DrawnBrakes(make_source(*arguments))

    for module in (registration, vector_env, player):
        monkeypatch.setattr(module, "make_source", drawing)
