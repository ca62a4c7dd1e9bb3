"""The differentiable LGMD against the float64 reference, its gradients, and the transfer to the kernel."""

import subprocess
import sys

import numpy as np
import pytest
from golden.sequences import looming, natural, random

from lgmd_gym.neuron import LGMD, LGMDParams, Response
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

torch = pytest.importorskip("torch")
from lgmd_gym.neuron.lgmd_torch import LEARNABLE, LGMDLayer, Softness  # noqa: E402

SHAPE, FRAMES = (16, 21), 24
PARAMS = {
    "default": LGMDParams(),
    "fixed inhibition": LGMDParams.fixed_inhibition(),
    "off only": LGMDParams.off_only(),
    "released": LGMDParams.released(),
    "literal": LGMDParams.literal(),
    "adaptive at a low F": LGMDParams(t_f=2.0, sigma_1=0.2, tau_g=40.0),
    "long persistence": LGMDParams(n_p=4, u=1.5, tau_1=50.0),
    "no persistence": LGMDParams(n_p=0, t_de=2.0),
    "product": LGMDParams(on_off_residue=0.5, theta_3=0.1, theta_1=0.7),
    "no adaptation": LGMDParams(tau_s=np.inf, weights=(0.5, 0.3, 0.0), tau_2=(0.0, 90.0, np.inf)),
    "no memory": LGMDParams(tau_s=0.0, n_ts=3, sigma_4=5.0, t_sp=0.55),
}


@pytest.fixture(autouse=True)
def one_thread():
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def clips(frames=FRAMES, shape=SHAPE):
    return np.stack([looming(shape, frames), natural(shape, frames), random(shape, frames)])


def reference(frames, params, **options):
    neuron = ReferenceLGMD(frames.shape[1:], params=params, **options)
    return np.array([neuron.step(frame) for frame in frames], float)


def outputs(response):
    return torch.stack([column.double() for column in response], -1).detach().numpy()


@pytest.mark.parametrize("name", PARAMS)
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-9), (torch.float32, 1e-5)])
def test_hard_outputs_equal_the_reference(name, dtype, tolerance):
    """The tolerance is absolute for potentials, and relative to the value for outputs above 1."""
    with torch.no_grad():
        response, state = LGMDLayer(params=PARAMS[name])(torch.from_numpy(clips()).to(dtype))
    expected = np.stack([reference(frames, PARAMS[name]) for frames in clips()])
    assert response._fields == Response._fields
    np.testing.assert_allclose(outputs(response), expected, rtol=tolerance, atol=tolerance)
    assert np.array_equal(response.spikes.numpy(), expected[..., 1])
    assert state.age == FRAMES
    if name in ("default", "released", "off only"):
        assert expected[0, :, 1].max() > 0


def test_a_mask_weights_the_pixels_as_in_the_reference():
    mask = np.zeros(SHAPE)
    mask[3:12, 4:15] = np.linspace(0.2, 1.0, 11)
    layer = LGMDLayer(mask=torch.from_numpy(mask))
    response, _ = layer(torch.from_numpy(clips()).double())
    expected = np.stack([reference(frames, None, mask=mask) for frames in clips()])
    np.testing.assert_allclose(outputs(response), expected, rtol=1e-9, atol=1e-9)


def test_steps_and_parts_equal_whole_clips():
    frames, layer = torch.from_numpy(clips()), LGMDLayer()
    whole, _ = layer(frames)
    state, steps = None, []
    for time in range(10):
        response, state = layer.step(frames[:, time], state)
        steps.append(response.adapted_potential)
    rest, _ = layer(frames[:, 10:], state.detach())
    joined = torch.cat([torch.stack(steps, 1), rest.adapted_potential], 1)
    assert torch.equal(joined, whole.adapted_potential)


def test_the_compiled_neuron_agrees():
    frames = looming((24, 37), 30)
    response, _ = LGMDLayer()(torch.from_numpy(frames)[None])
    neuron = LGMD((24, 37))
    expected = [neuron.step(frame) for frame in frames]
    assert response.spikes[0].tolist() == [item.spikes for item in expected]
    assert response.alert[0].tolist() == [item.alert for item in expected]
    assert response.spikes.max() > 0


def smooth_clip(frames=7, shape=(5, 6)):
    """Return a clip without equal pixels, so that no maximum or half-wave is at its kink."""
    noise = np.random.default_rng(3).normal(size=(1, frames, *shape))
    return torch.from_numpy(120.0 + looming(shape, frames)[None] / 3.0 + 4.0 * noise)


@pytest.mark.parametrize(
    "params",
    [
        {"t_de": 3.0, "t_f": 12.0, "t_ffi": 14.0, "sigma_3": 2.0, "t_sp": 0.6},
        {"t_de": 3.0, "on_off_residue": 0.2, "delay": "two-tap", "latency": "jump", "k_0": 0.3, "t_sp": 0.6},
    ],
)
def test_gradients_equal_differences(params):
    """`gradcheck` on the frames and on every finite parameter that has a gradient."""
    params = LGMDParams.make(params)
    skipped = {"t_sf"} | ({"t_ffi"} if np.isinf(params.t_ffi) else set())
    names = [name for name in LEARNABLE if name not in skipped]
    layer = LGMDLayer(params=params, learn=names, softness=Softness()).double()
    learned = [layer.learned[name] for name in names]

    def function(frames, *values):
        given = {f"learned.{name}": value for name, value in zip(names, values, strict=True)}
        response, _ = torch.func.functional_call(layer, given, (frames,))
        return response.spike_frequency, response.adapted_potential, response.membrane_potential, response.ffi

    frames = smooth_clip().requires_grad_()
    assert torch.autograd.gradcheck(function, (frames, *learned), eps=1e-6, atol=1e-4, rtol=1e-3)
    loss = sum(item.sum() for item in function(frames, *learned))
    gradients = torch.autograd.grad(loss, (frames, *learned))
    assert all(torch.isfinite(item).all() for item in gradients)
    silent = {name for name, item in zip(names, gradients[1:], strict=True) if not item.any()}
    expected = {"k_0", "on_off_residue"} if params.k_0 == 0.5 else {"tau_1"}
    assert silent <= expected | {"theta_3", "sigma_1", "sigma_2", "t_f", "tau_1"}


def test_narrow_thresholds_approach_the_hard_model():
    narrow = Softness(grouping=1e-6, adaptation=1e-9, silence=1e-6, floor=1e-6, spikes=1e-6)
    frames = torch.from_numpy(clips()).double()
    soft, _ = LGMDLayer(softness=narrow)(frames)
    hard, _ = LGMDLayer()(frames)
    assert torch.allclose(soft.adapted_potential, hard.adapted_potential, atol=1e-6)
    drive = torch.exp(10.0 * (hard.adapted_potential - 0.7))
    assert torch.allclose(soft.spikes[:, 1:], (drive[:, 1:] - 0.5).clamp(min=0.0), atol=1e-4)


def test_surrogate_gradients_keep_the_hard_outputs():
    frames = torch.from_numpy(clips()).double()
    hard, _ = LGMDLayer()(frames)
    layer = LGMDLayer(learn=["t_de", "t_sp", "sigma_3"], softness=Softness(surrogate=True))
    response, _ = layer(frames)
    for ours, theirs in zip(response, hard, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-9, atol=1e-9)
    response.spike_frequency.sum().backward()
    assert {name: float(item.grad) < 0.0 for name, item in layer.learned.items()} == dict.fromkeys(
        layer.learned, True
    )


def test_hard_outputs_have_gradients_above_the_thresholds():
    layer = LGMDLayer(learn=["sigma_3", "t_de"])
    response, _ = layer(torch.from_numpy(clips()))
    response.membrane_potential.sum().backward()
    assert layer.learned["sigma_3"].grad < 0.0
    assert layer.learned["t_de"].grad is None


def test_descent_reduces_a_loss_and_the_kernel_takes_the_result():
    frames = torch.from_numpy(looming(SHAPE, FRAMES))[None]
    layer = LGMDLayer(params={"sigma_3": 20.0}, learn=["sigma_3", "tau_2"], softness=Softness())
    optimizer = torch.optim.Adam(layer.parameters(), lr=0.05)
    losses = []
    for _ in range(20):
        response, _ = layer(frames)
        loss = (response.spike_frequency.max() - 60.0).square()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        layer.clamp_()
        losses.append(loss.item())
    assert losses[-1] < 0.2 * losses[0]
    params = layer.to_params()
    assert params.sigma_3 < 20.0
    assert params.n_p == 2
    neuron = LGMD(SHAPE, params=params)
    assert max(neuron.step(frame).spikes for frame in looming(SHAPE, FRAMES)) > 0


def test_parameters_start_at_their_values_and_are_clamped_to_their_ranges():
    layer = LGMDLayer(learn=["theta_1", "tau_2", "t_sp", "c_w"], params=LGMDParams.off_only())
    assert layer.to_params() == LGMDParams.off_only()
    assert {name: item.tolist() for name, item in layer.learned.items()} == {
        "theta_1": 0.0, "tau_2": [1.0, 1.0, 1.0], "t_sp": 1.0, "c_w": 1.0,
    }  # fmt: skip
    with torch.no_grad():
        for item in layer.parameters():
            item -= 3.0
    layer.clamp_()
    params = layer.to_params()
    assert (params.theta_1, params.tau_2, params.t_sp) == (0.0, (0.0, 0.0, 0.0), 0.0)
    assert 0.0 < params.c_w < 1e-5
    with torch.no_grad():
        layer.learned["t_sp"] += 3.0
    assert layer.clamp_().to_params().t_sp == 1.0


def test_every_real_parameter_can_be_learned():
    finite = [name for name in LEARNABLE if name != "t_ffi"]
    assert {"n_p", "n_ts"}.isdisjoint(LEARNABLE)
    assert len(finite) == 23
    assert LGMDLayer(learn=finite).to_params() == LGMDParams()


def test_saved_parameters_are_restored(tmp_path):
    layer = LGMDLayer(learn=["sigma_3"])
    with torch.no_grad():
        layer.learned["sigma_3"] *= 1.5
    torch.save(layer.state_dict(), tmp_path / "layer.pt")
    other = LGMDLayer(learn=["sigma_3"])
    other.load_state_dict(torch.load(tmp_path / "layer.pt", weights_only=True))
    assert other.to_params() == LGMDParams(sigma_3=1.5)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (
            lambda: LGMDLayer(learn=["sigma3"]),
            "'sigma3'; did you mean 'sigma_3'?",
        ),
        (lambda: LGMDLayer(learn=["n_p"]), "unknown learnable parameter 'n_p'"),
        (lambda: LGMDLayer(learn=["t_ffi"]), "t_ffi = inf cannot be learned; start from a finite value"),
        (lambda: LGMDLayer(fps=0.0), "fps must be > 0 and finite, got 0"),
        (
            lambda: LGMDLayer(softness={"spike": 1.0}),
            "'spike'; did you mean 'spikes'?",
        ),
        (lambda: LGMDLayer(softness={"spikes": 0.0}), r"softness spikes must be in \(0, inf\) spikes, got 0"),
        (lambda: LGMDLayer()(torch.zeros(3, 4, 5)), r"frames must have the shape \(N, T, height, width\)"),
        (lambda: LGMDLayer()(torch.zeros(1, 0, 4, 5)), r"none of them 0, got \(1, 0, 4, 5\)"),
        (lambda: LGMDLayer()(torch.rand(1, 2, 4, 5)), r"got floats of 0\.\d+ to 0\.\d+; use frames \* 255"),
        (lambda: LGMDLayer().step(torch.zeros(4, 5)), r"frame must have the shape \(N, height, width\)"),
    ],
)
def test_invalid_arguments_are_one_line(action, message):
    with pytest.raises(ValueError, match=message) as error:
        action()
    assert "\n" not in str(error.value)


def test_no_operation_leaves_the_device_of_the_frames():
    """Tensors of the device `meta` have no data: an operation with a tensor of the CPU would raise."""
    layer = LGMDLayer(learn=["sigma_3"], softness=Softness(), mask=torch.ones(SHAPE)).to("meta")
    state = None
    for _ in range(3):
        response, state = layer.step(torch.zeros(2, *SHAPE, device="meta"), state)
    assert {column.device.type for column in response} == {"meta"}


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_equals_the_cpu():
    frames = torch.from_numpy(clips()).double()
    expected, _ = LGMDLayer(softness=Softness())(frames)
    response, _ = LGMDLayer(softness=Softness()).to("cuda")(frames.to("cuda"))
    for ours, theirs in zip(response, expected, strict=True):
        torch.testing.assert_close(ours.cpu(), theirs, rtol=1e-9, atol=1e-9)


def test_the_package_does_not_load_torch():
    code = "import sys, lgmd_gym, lgmd_gym.neuron; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
