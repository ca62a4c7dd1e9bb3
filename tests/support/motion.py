"""Motion detectors in plain NumPy, and frames that move."""

import numpy as np


def motion_maps(frames, params, fps=30.0):
    """Yield the motion to the right and downwards of each frame after the first one (eq. 1 to 4)."""
    frames = np.asarray(frames, float)
    dt = 1000.0 / fps
    beta, alpha = dt / (dt + params.tau_mean_ms), dt / (dt + params.tau_delay_ms)
    mean, late = frames[0].copy(), np.zeros((2, *frames[0].shape))
    for frame in frames[1:]:
        change = frame - mean
        mean += beta * change
        now = np.stack([np.maximum(change, 0.0), np.maximum(-change, 0.0)])
        right, down = np.zeros(frame.shape), np.zeros(frame.shape)
        right[:, :-1] = _correlation(late[:, :, :-1], now[:, :, 1:], now[:, :, :-1], late[:, :, 1:])
        down[:-1] = _correlation(late[:, :-1], now[:, 1:], now[:, :-1], late[:, 1:])
        late += alpha * (now - late)
        yield right, down


def _correlation(late_1, now_2, now_1, late_2):
    c = (late_1 * now_2 - now_1 * late_2).sum(0)
    return np.sign(c) * np.sqrt(np.abs(c))


def square(half, centre=(32.0, 20.0), shape=(40, 64), grey=40, background=180):
    """Return a frame with a square: half of its side and its centre (x, y) [px], with soft edges."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    inside = np.minimum(half - np.abs(x - centre[0]), half - np.abs(y - centre[1]))
    share = np.clip(inside + 0.5, 0.0, 1.0)
    return np.round(background + share * (grey - background)).astype(np.uint8)
