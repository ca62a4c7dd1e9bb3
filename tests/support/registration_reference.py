"""The far-field registration in plain NumPy, block by block, as a reference for the kernels."""

import math

import numpy as np

NEW = 1e6
PAD, MARGIN_ROWS, MARGIN_COLUMNS, BANDS, BLOCK = 8, 2, 8, 4, 16


def smoothed(frame):
    """Return the frame with repeated edges, smoothed by a binomial of 3 × 3 px."""
    rows = np.pad(frame.astype(float), PAD + 1, mode="edge")
    rows = (rows[:-2] + 2.0 * rows[1:-1] + rows[2:]) / 4.0
    return (rows[:, :-2] + 2.0 * rows[:, 1:-1] + rows[:, 2:]) / 4.0


class Reference:
    """Registration of one camera; arguments as for `FarFieldRegistration`."""

    def __init__(self, shape, fps, focal_px, params):
        self.shape, self.focal, self.p = shape, focal_px, params
        self.rates = [
            1.0 - math.exp(-1.0 / (s * fps)) for s in (params.reference_s, params.variance_s, params.mean_s)
        ]
        self.image = None

    def blocks(self):
        """Yield the slices of each block, those with the margins beside it, and its middle (y, x)."""
        height, width = self.shape
        band, count = (height - 2 * MARGIN_ROWS) // BANDS, (width - 2 * MARGIN_COLUMNS) // BLOCK
        for b in range(BANDS):
            for k in range(count):
                y, x = MARGIN_ROWS + b * band, MARGIN_COLUMNS + k * BLOCK
                inner = slice(y, y + band), slice(x, x + BLOCK)
                rows = slice(0 if b == 0 else y, height if b == BANDS - 1 else y + band)
                columns = slice(0 if k == 0 else x, width if k == count - 1 else x + BLOCK)
                yield inner, (rows, columns), y + 0.5 * (band - height), x + 0.5 * (BLOCK - width)

    def warped(self, padded, pitch, roll, yaw):
        """Return the frame with each block shifted, by bilinear interpolation."""
        out = np.empty(self.shape)
        for _, (rows, columns), y, x in self.blocks():
            dy = np.clip(pitch + roll * x, 1.0 - PAD, PAD - 1.001)
            dx = np.clip(yaw - roll * y, 1.0 - PAD, PAD - 1.001)
            i, j = math.floor(dy), math.floor(dx)
            part = padded[
                PAD + rows.start + i : PAD + rows.stop + i + 1,
                PAD + columns.start + j : PAD + columns.stop + j + 1,
            ]
            part = part[:, :-1] + (dx - j) * (part[:, 1:] - part[:, :-1])
            out[rows, columns] = part[:-1] + (dy - i) * (part[1:] - part[:-1])
        return out

    def step(self, frame, turn=0.0):
        """Return pitch, roll and yaw [degrees]."""
        padded, p = smoothed(frame), self.p
        if self.image is None:
            self.image = padded[PAD:-PAD, PAD:-PAD].copy()
            self.variance = np.full(self.shape, p.first_variance)
            self.q = np.array([0.0, 0.0, 0.0, 1.0, 128.0])
            self.mean, self.count, self.pan = np.zeros(3), 0, 0.0
            return np.zeros(3)
        self.follow(-self.focal * turn)
        expected = np.array([0.0, 0.0, self.pan, *self.q[3:]])
        prior = 1.0 / np.array([p.pitch_px, p.roll_rad, p.yaw_px, p.gain, p.offset]) ** 2
        for _ in range(3):
            matrix, right = self.equations(self.warped(padded, *self.q[:3]))
            self.q += np.linalg.solve(matrix + np.diag(prior), right + prior * (expected - self.q))
        self.adapt(self.warped(padded, *self.q[:3]))
        rotation = self.q[:3] - [0.0, 0.0, self.pan] - self.mean
        self.mean += self.rates[2] * rotation
        return np.degrees([rotation[0] / self.focal, -rotation[1], -rotation[2] / self.focal])

    def follow(self, shift):
        """Shift the reference with the turn of the car [px]."""
        self.pan += shift
        self.q[2] += shift
        n = int(np.rint(self.pan))
        self.pan -= n
        self.q[2] -= n
        source = np.arange(self.shape[1]) - n
        known = (source >= 0) & (source < self.shape[1])
        self.image[:, known] = self.image[:, source[known]].copy()
        self.variance[:, known] = self.variance[:, source[known]].copy()
        self.variance[:, ~known] = NEW

    def equations(self, warped):
        """Return the normal equations of pitch, roll, yaw, gain and offset."""
        p, gain, offset = self.p, *self.q[3:]
        expected = gain * (self.image - 128.0) + offset
        rise, slope = np.gradient(0.5 * (warped + expected))
        residual = expected - warped
        spread = self.variance + p.least_variance + p.edge**2 * (rise**2 + slope**2)
        weight = p.share * p.outlier**2 * spread / (p.outlier * spread + residual**2) ** 2
        matrix, right = np.zeros((5, 5)), np.zeros(5)
        for part, _, y, x in self.blocks():
            up, along, grey = rise[part], slope[part], self.image[part] - 128.0
            columns = (up, x * up - y * along, along, -grey, -np.ones_like(grey))
            a = np.stack(columns, axis=-1).reshape(-1, 5)
            weighted = a * weight[part].reshape(-1, 1)
            matrix += a.T @ weighted
            right += weighted.T @ residual[part].ravel()
        return matrix, right

    def adapt(self, warped):
        gain, offset = self.q[3:]
        residual = gain * (self.image - 128.0) + offset - warped
        self.count += 1
        equal = (warped - offset) / gain + 128.0
        new = self.variance > 0.5 * NEW
        self.image = np.where(new, equal, self.image + self.rates[0] * (equal - self.image))
        share = max(self.rates[1], 1.0 / (self.count + 1.0))
        followed = self.variance + share * (residual**2 - self.variance)
        self.variance = np.where(new, self.p.first_variance, followed)
