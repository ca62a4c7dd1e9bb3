"""Weights of dense networks are read without PyTorch, to the same bits, and no code of a file is executed."""

import io
import os
import pickle
import subprocess
import sys
import zipfile

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from support.policies import random_inputs, write_policy

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import CARD, write_card
from lgmd_gym.agents.policies.dense import DenseNetwork, Linear, dense_shapes, load_steps
from lgmd_gym.agents.policies.network import NetworkSpec, dense_layers, dense_steps, describe_network
from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.agents.policies.weights import MAX_PICKLE, WEIGHTS, read_weights

INPUTS = {"ego_speed": (3,), "columns": (5,)}
VALUES = np.arange(6, dtype=np.float32) / 7.0


class Blank(gym.Env):
    """Environment that has nothing but spaces."""

    observation_space = spaces.Dict({name: spaces.Box(-5.0, 5.0, shape) for name, shape in INPUTS.items()})
    action_space = spaces.Discrete(3)


def plain(value):
    return pickle.dumps(value, 2)[2:-1]


def named(name):
    module, _, attribute = name.rpartition(".")
    return f"c{module}\n{attribute}\n".encode()


FLOAT, DATA = named("torch.FloatStorage"), VALUES.tobytes()


def tensor(key="0", count=6, offset=0, size=(2, 3), stride=(3, 1), storage=FLOAT):
    """Return the operations that make a tensor, as PyTorch writes them; arguments of bytes are operations."""
    key, count, size, stride = (
        item if isinstance(item, bytes) else plain(item) for item in (key, count, size, stride)
    )
    place = b"(" + plain("storage") + storage + key + plain("cpu") + count + b"tQ"
    hooks = named("collections.OrderedDict") + b")R"
    arguments = place + plain(offset) + size + stride + plain(False) + hooks
    return named("torch._utils._rebuild_tensor_v2") + b"(" + arguments + b"tR"


def state(item, name="weight"):
    """Return the operations that make named weights, and set their version numbers."""
    items = named("collections.OrderedDict") + b")R(" + plain(name) + item + b"u"
    return b"\x80\x02" + items + b"}" + plain("_metadata") + b"}sb."


def write_model(path, pickled, folder="archive", order=b"little", values=DATA, extra=(), packed=False):
    """Write a model file with these weights."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED) as weights:
        members = {"data.pkl": pickled, "byteorder": order, "data/0": values, **dict(extra)}
        for name, content in members.items():
            if content is not None:
                weights.writestr(f"{folder}/{name}", content)
    with zipfile.ZipFile(path, "w") as model:
        model.writestr(WEIGHTS, data.getvalue())
    return path


@pytest.mark.parametrize(("options", "place", "expected"), [
    ({}, {}, VALUES.reshape(2, 3)),
    ({"folder": "policy"}, {"size": (3, 2), "stride": (1, 3)}, VALUES.reshape(2, 3).T),
    ({"order": None}, {"offset": 2, "size": (2,), "stride": (3,)}, VALUES[[2, 5]]),
    ({"order": b"big", "values": VALUES.astype(">f4").tobytes()}, {}, VALUES.reshape(2, 3)),
    ({}, {"size": (), "stride": (), "offset": 5}, VALUES[5]),
])  # fmt: skip
def test_tensors_are_views_of_their_storage(tmp_path, options, place, expected):
    weights = read_weights(write_model(tmp_path / "model.zip", state(tensor(**place)), **options))
    assert list(weights) == ["weight"]
    assert np.array_equal(weights["weight"], expected)
    assert not weights["weight"].flags.writeable


class Attack:
    """Its unpickling ends the process."""

    def __reduce__(self):
        return os._exit, (7,)


ENDLESS = tensor(size=(2**60,), stride=(0,))  # a view of one number
PAIRS = plain(()) + b"q\x01" + b"h\x01h\x01\x86q\x01" * 60  # of pairs of pairs


@pytest.mark.parametrize(("pickled", "words"), [
    (pickle.dumps(Attack(), 2), "must not contain '(posix|nt)._exit'"),
    (state(named("builtins.eval")), "must not contain 'builtins.eval'"),
    (state(named("os.system") + plain(("true",)) + b"R"), "must not contain 'os.system'"),
    (pickle.dumps({"weight": [1.0]}, 4), "are damaged"),
    (state(tensor(size=(3, 3))), "outside of their storage"),
    (state(tensor(stride=(4, 1))), "outside of their storage"),
    (state(tensor(size=(5,), stride=(2**60,))), "outside of their storage"),
    (state(tensor(size=(2**40, 3), stride=(3, 1))), "outside of their storage"),
    (state(tensor(size=(0, 3))), "outside of their storage"),
    (state(tensor(offset=1)), "outside of their storage"),
    (state(tensor(offset=-1)), "shapes of its weights are damaged"),
    (state(tensor(stride=(-3, 1))), "shapes of its weights are damaged"),
    (state(tensor(size=(True, 3))), "shapes of its weights are damaged"),
    (state(tensor(size=(2.0, 3))), "are damaged"),
    (state(tensor(size=(6,))), "shapes of its weights are damaged"),
    (state(tensor(size=6)), "are damaged"),
    (state(tensor(count=7)), "storage '0' must have 7 values"),
    (state(tensor(count=2**40)), "storage '0' must have"),
    (state(tensor(key="1")), "are damaged"),
    (state(tensor(key=0)), "must be in storages"),
    (state(tensor(storage=plain("double"))), "must be in storages"),
    (state(tensor(), name=7), "must have names"),
    (state(tensor(), name=((1, 2), 3)), "must have names"),
    (b"\x80\x02}(" + PAIRS + plain(0) + b"u.", "must have names"),
    (state(plain(3)), "not tensors by name"),
    (b"\x80\x02" + tensor() + b".", "not tensors by name"),
    (b"\x80\x02" + named("collections.OrderedDict") + ENDLESS + b"R.", "are damaged"),
    (state(tensor(size=ENDLESS)), "shapes of its weights are damaged"),
    (state(tensor(stride=ENDLESS)), "shapes of its weights are damaged"),
    (state(tensor(count=ENDLESS)), "must be in storages"),
    (state(tensor(key=ENDLESS)), "must be in storages"),
    (state(tensor(storage=ENDLESS)), "must be in storages"),
    (state(tensor())[:-1], "are damaged"),
    (state(tensor())[:-40], "its weights"),
    (b"", "are damaged"),
    (bytes(MAX_PICKLE + 1), f"one data.pkl of at most {MAX_PICKLE} bytes"),
], ids=lambda value: value if isinstance(value, str) else "")  # fmt: skip
def test_other_pickles_are_refused(tmp_path, pickled, words):
    """Also those that would read outside of a storage, or take for ever."""
    path = write_model(tmp_path / "model.zip", pickled)
    with pytest.raises(ValueError, match=words):
        read_weights(path)


@pytest.mark.parametrize("pickled", [state(tensor()) + b"more", b"\x80\x02}r\xff\xff\xff\xff."])
def test_a_pickle_ends_with_its_stop_and_a_large_index_takes_no_memory(tmp_path, pickled):
    assert read_weights(write_model(tmp_path / "model.zip", pickled)) is not None


@pytest.mark.parametrize(("options", "words"), [
    ({"order": b"middle"}, "are damaged"),
    ({"values": VALUES.tobytes()[:-1]}, "multiple of element size"),
    ({"values": VALUES.tobytes()[:-4]}, "storage '0' must have 6 values"),
    ({"values": None}, "are damaged"),
    ({"extra": {"more/data.pkl": b""}}, "must have one data.pkl"),
])  # fmt: skip
def test_other_archives_are_refused(tmp_path, options, words):
    with pytest.raises(ValueError, match=words):
        read_weights(write_model(tmp_path / "model.zip", state(tensor()), **options))


@pytest.mark.parametrize("inside", [True, False])
def test_weights_that_unpack_to_too_much_are_refused(tmp_path, monkeypatch, inside):
    monkeypatch.setattr("lgmd_gym.agents.policies.weights.MAX_BYTES", 2000)
    more = {"data/1": bytes(2000)} if inside else {}
    path = write_model(tmp_path / "model.zip", state(tensor()), extra=more, packed=inside)
    if not inside:
        with zipfile.ZipFile(path, "a") as model:
            model.writestr("data", bytes(2000))
    with pytest.raises(ValueError, match="bytes, more than 2000"):
        read_weights(path)


@pytest.mark.parametrize("name", ["torch.DoubleStorage", "torch._utils._rebuild_parameter"])
def test_other_objects_of_torch_are_left_to_it(tmp_path, name):
    assert read_weights(write_model(tmp_path / "model.zip", state(named(name)))) is None


def test_another_format_is_left_to_torch(tmp_path):
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as model:
        model.writestr(WEIGHTS, pickle.dumps(Attack()))
    assert read_weights(tmp_path / "model.zip") is None


@pytest.mark.parametrize(("algo", "changes", "actions"), [
    ("sac", {}, 2),
    ("ppo", {}, None),
    ("ppo", {"policy": "MlpPolicy"}, 2),
    ("ppo", {"inputs": INPUTS | {"frame": (36, 36, 1)}}, 2),
    ("ppo", {"inputs": {}}, 2),
    ("ppo", {"policy_kwargs": {"activation_fn": "ELU"}}, 2),
    ("ppo", {"policy_kwargs": {"activation_fn": None}}, 2),
    ("ppo", {"policy_kwargs": {"use_sde": True}}, 2),
    ("ppo", {"policy_kwargs": {"features_extractor_kwargs": {"normalized_image": True}}}, 2),
    ("ppo", {"policy_kwargs": {"net_arch": [8.0]}}, 2),
    ("ppo", {"policy_kwargs": {"net_arch": [0]}}, 2),
    ("ppo", {"policy_kwargs": {"net_arch": {"pi": 8}}}, 2),
    ("dqn", {"policy_kwargs": {"net_arch": {"pi": [8]}}}, 2),
    ("dqn", {"policy_kwargs": {"ortho_init": False}}, 2),
])  # fmt: skip
def test_other_networks_are_left_to_torch(tmp_path, algo, changes, actions):
    spec = NetworkSpec(**{"policy": "MultiInputPolicy", "inputs": INPUTS} | changes)
    assert dense_shapes(spec, algo, actions) is None
    assert load_steps(spec, tmp_path / "missing.zip", algo, actions) is None


MODELS = [
    ("PPO", {}),
    ("PPO", {"net_arch": [8]}),
    ("PPO", {"net_arch": []}),
    ("PPO", {"net_arch": {"pi": [9, 7], "vf": [4]}, "activation_fn": "ReLU"}),
    ("PPO", {"net_arch": {"vf": [4]}, "ortho_init": False}),
    ("A2C", {}),
    ("A2C", {"net_arch": [8], "activation_fn": "ReLU"}),
    ("DQN", {}),
    ("DQN", {"net_arch": [8, 5, 3], "activation_fn": "Tanh"}),
    ("DQN", {"net_arch": []}),
]


def make_model(algo, kwargs):
    stable_baselines3, torch = pytest.importorskip("stable_baselines3"), pytest.importorskip("torch")
    kwargs = dict(kwargs)
    if "activation_fn" in kwargs:
        kwargs["activation_fn"] = getattr(torch.nn, kwargs["activation_fn"])
    algorithm = getattr(stable_baselines3, algo)
    return algorithm("MultiInputPolicy", Blank(), policy_kwargs=kwargs, seed=0, device="cpu")


@pytest.mark.parametrize(("algo", "kwargs"), MODELS)
def test_arrays_equal_those_that_torch_loads(tmp_path, algo, kwargs):
    model = make_model(algo, kwargs)
    path = tmp_path / "model.zip"
    model.save(path)
    spec = describe_network(model)
    expected = {name: tuple(value.shape) for name, value in model.policy.state_dict().items()}
    assert list(dense_shapes(spec, algo, 3).items()) == list(expected.items())
    weights = read_weights(path)
    for name, value in model.policy.state_dict().items():
        assert np.array_equal(weights[name], value.numpy())
    steps = load_steps(spec, path, algo, 3)
    for step, other in zip(steps, dense_steps(dense_layers(spec.load(path, algo, 3))), strict=True):
        assert type(step) is type(other)
        for array, same in zip(step, other, strict=True) if isinstance(step, Linear) else ():
            assert array.dtype == same.dtype == np.float32
            assert np.array_equal(array, same)
            assert array.flags.c_contiguous
            assert not array.flags.writeable
        assert isinstance(step, Linear) or step is other


def test_weights_of_another_type_are_loaded_with_torch(tmp_path):
    pytest.importorskip("stable_baselines3")
    import torch

    file = write_policy(tmp_path / "small.zip")
    expected = Policy(str(file)).decide(random_inputs(50))
    with zipfile.ZipFile(file) as source, zipfile.ZipFile(tmp_path / "double.zip", "w") as target:
        for name in source.namelist():
            if name == WEIGHTS:
                with source.open(name) as weights, target.open(name, "w") as member:
                    items = torch.load(weights, weights_only=True)
                    torch.save({key: item.double() for key, item in items.items()}, member)
            else:
                target.writestr(name, source.read(name))
    assert read_weights(tmp_path / "double.zip") is None
    assert Policy(str(tmp_path / "double.zip")).decide(random_inputs(50)) == expected


@pytest.mark.parametrize("margin", [0.0, 2.5, -1e-3, 1 / 3, 19.87654321])
def test_values_equal_those_of_the_network_of_torch(tmp_path, margin):
    pytest.importorskip("stable_baselines3")
    policy = Policy(str(write_policy(tmp_path / "small.zip")), margin)
    inputs, names = random_inputs(50), tuple(policy.network.observation_space.spaces)
    reference = DenseNetwork(dense_steps(dense_layers(policy.network)), names)
    assert np.array_equal(policy._values(inputs), reference(inputs))


def test_policies_of_a_process_share_their_weights():
    first, second = Policy("all-round"), Policy("all-round")
    for step, other in zip(first._values._steps, second._values._steps, strict=True):
        assert step is other


DRIVE = """
import sys
import gymnasium as gym
from lgmd_gym.agents import make_agent
agent = make_agent("policy:all-round")
env = gym.make("LGMD/CCRs-v0", ego_speed=11.0, camera=agent.camera, world="laboratory")
observation, info = env.reset(seed=1)
agent.reset(1)
assert agent.act(observation, info).shape == (1,)
print([name for name in ("torch", "stable_baselines3") if sys.modules.get(name) is not None])
"""
WITHOUT = "import sys; sys.modules |= {'torch': None, 'stable_baselines3': None}\n"
REFUSED = """
for load in (lambda: agent.agent.network, lambda: make_agent(f"policy:{sys.argv[1]}")):
    try:
        load()
    except ValueError as error:
        print(error)
"""


def run(code, *arguments):
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )


def test_the_shipped_policy_does_not_import_torch():
    assert run(DRIVE).stdout == "[]\n"


def test_without_torch_the_shipped_policy_drives_and_others_state_the_extra(tmp_path):
    with zipfile.ZipFile(tmp_path / "mine.zip", "w") as model:
        model.writestr(CARD, '{"algo": "ppo", "camera": "fovea"}')
    lines = run(WITHOUT + DRIVE + REFUSED, str(tmp_path / "mine.zip")).stdout.splitlines()
    assert lines[0] == "[]"
    assert len(lines) == 3
    assert all('a policy requires the extra "train": pip install' in line for line in lines[1:])


@pytest.mark.parametrize("algo", ["PPO", "DQN"])
def test_a_margin_requires_log_odds(tmp_path, monkeypatch, algo):
    monkeypatch.setattr(Blank, "observation_space", spaces.Dict(ego_speed=spaces.Box(-5.0, 5.0, (1,))))
    monkeypatch.setattr(Blank, "action_space", spaces.Discrete(2))
    model, path = make_model(algo, {"net_arch": [4]}), tmp_path / "mine.zip"
    model.save(path)
    card = {
        "algo": algo,
        "camera": "fovea",
        "demands": [0.0, -1.0],
        "network": describe_network(model).to_dict(),
    }
    write_card(path, card | {"features": {"inputs": ["ego_speed"], "history": 1}})
    assert make_agent(f"policy:{path}").agent.card.demands == (0.0, -1.0)
    if algo == "PPO":
        assert make_agent(f"policy:{path}:margin=1").agent.name.endswith(":margin=1")
    else:
        with pytest.raises(ValueError, match="must have two demands and action probabilities for margin=1"):
            make_agent(f"policy:{path}:margin=1")
