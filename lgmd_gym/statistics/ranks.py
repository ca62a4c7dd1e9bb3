"""Statistics of ranks."""

import numpy as np


def roc_area(positives: np.ndarray, negatives: np.ndarray) -> float:
    """Return the area under the ROC curve: how often a positive has the higher score, ties counted half.

    Args:
        positives: Scores of the positives, shape (m,).
        negatives: Scores of the negatives, shape (n,).

    Returns:
        The area in [0, 1]; NaN without positives or without negatives.

    Example:
        >>> roc_area(np.array([0.9, 0.5]), np.array([0.5, 0.1]))
        0.875
    """
    if not len(positives) or not len(negatives):
        return float("nan")
    ordered = np.sort(negatives)
    below = np.searchsorted(ordered, positives, side="left")
    not_above = np.searchsorted(ordered, positives, side="right")
    return float(np.mean((below + not_above) / 2.0) / len(negatives))
