"""The parts of PPO in `docs/examples/vector_cleanrl.py`."""

import numpy as np
import pytest
from support.examples import load

torch = pytest.importorskip("torch")

ppo = load("vector_cleanrl")


def random_batch(steps=6, num_envs=3):
    generator = torch.Generator().manual_seed(0)
    inputs = torch.randn(steps, num_envs, len(ppo.SCALES), generator=generator)
    actions = torch.randint(2, (steps, num_envs), generator=generator)
    rewards, values = torch.randn(2, steps, num_envs, generator=generator)
    dones = (torch.rand(steps, num_envs, generator=generator) < 0.3).float()
    return ppo.Batch(inputs, actions, torch.zeros(steps, num_envs), rewards, values, dones)


def test_every_iteration_prints_the_mean_return(capsys):
    returns = ppo.main(iterations=3, args=ppo.Args(num_envs=4, steps=48))
    lines = capsys.readouterr().out.splitlines()
    assert len(returns) == len(lines) >= 2
    assert lines[-1].startswith(f"step 576: mean return {returns[-1]:.2f}, ")
    assert all(-30.0 < value < 15.0 for value in returns)


@pytest.mark.slow
def test_training_improves_the_return():
    returns = ppo.main(iterations=8, args=ppo.Args(num_envs=16, steps=64))
    assert returns[-1] > returns[0] + 1.0


def test_advantages_are_the_sums_of_their_definition():
    args, batch, last = ppo.Args(gamma=0.9, gae_lambda=0.8), random_batch(), torch.tensor([1.0, -2.0, 3.0])
    values = torch.cat([batch.values, last[None]])
    assert batch.dones.any()
    for env in range(3):
        for start in range(6):
            total, factor = 0.0, 1.0
            for step in range(start, 6):
                alive = 1.0 - batch.dones[step, env]
                error = batch.rewards[step, env] + 0.9 * alive * values[step + 1, env] - values[step, env]
                total, factor = total + factor * error, factor * 0.72 * alive
            assert ppo.advantages(batch, last, args)[start, env] == pytest.approx(float(total), abs=1e-5)


def updated(clip):
    """Return by how much an update increases the probability of braking, and the error of the values."""
    torch.manual_seed(0)
    batch, args = random_batch(40, 8), ppo.Args(entropy=0.0, epochs=30, clip=clip)
    network = ppo.Network(len(ppo.SCALES), 2)
    with torch.no_grad():
        network.actor[-1].bias.zero_()
        before = network(batch.inputs.flatten(0, 1))[0]
        batch.log_probs = before.log_prob(batch.actions.flatten()).view_as(batch.log_probs)
        batch.values.zero_()
    gains = torch.where(batch.actions == 1, 1.0, -1.0)
    ppo.update(network, torch.optim.Adam(network.parameters(), 1e-3), batch, gains, args)
    with torch.no_grad():
        after, values = network(batch.inputs.flatten(0, 1))
    ratio = (after.probs[:, 1] / before.probs[:, 1]).mean()
    return float(ratio), float((values - gains.flatten()).square().mean())


def test_an_update_makes_good_actions_likelier_within_the_clip():
    (near, error), (far, _) = updated(0.2), updated(10.0)
    assert 1.1 < near < 0.9 * far
    assert error < 1.0  # of values of zero


class CutOff:
    """Two environments that end at every step, the second because of its time limit."""

    def __init__(self):
        self.state = {name: np.zeros((2, 1), np.float32) for name in ppo.SCALES}

    def step(self, actions):
        final = np.array([None, {name: np.full(1, 5.0, np.float32) for name in ppo.SCALES}], dtype=object)
        flags = np.array([True, False]), np.array([False, True])
        return self.state, np.array([2.0, 2.0]), *flags, {"final_obs": final}


def test_an_episode_that_is_cut_off_has_the_value_of_its_last_state():
    torch.manual_seed(0)
    network, args, envs = ppo.Network(len(ppo.SCALES), 2), ppo.Args(steps=1, gamma=0.5), CutOff()
    batch, inputs = ppo.collect(envs, network, ppo.features(envs.state), args)
    last = torch.tensor([[5.0 / scale for scale in ppo.SCALES.values()]])
    value = network(last)[1].item()
    assert batch.rewards[0].tolist() == pytest.approx([0.2, 0.2 + 0.5 * value])
    assert batch.dones[0].tolist() == [1.0, 1.0]
    assert inputs.shape == (2, len(ppo.SCALES))


def test_braking_is_rare_at_first():
    network = ppo.Network(len(ppo.SCALES), 2)
    probability = network(torch.zeros(1, len(ppo.SCALES)))[0].probs[0, 1].item()
    assert probability == pytest.approx(0.047, abs=0.003)
