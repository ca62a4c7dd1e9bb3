"""Standardised features: each with mean 0 and standard deviation 1 over the training episodes.

The levels of columns have standard deviations of 0.08 to 0.65, and Adam's steps are equally long for all
weights, so that it learns faster from features of equal spread. After training the mean and the scale become
part of the first layer: the saved policy reads the features as they are.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import torch

MIN_VARIANCE = 1e-3  # added, so that features that hardly vary are not magnified


class Standardisation(NamedTuple):
    """Mean and scale of each feature.

    Attributes:
        mean: Mean, (features,).
        scale: One over the standard deviation, (features,).
    """

    mean: torch.Tensor
    scale: torch.Tensor

    def apply(self, features: torch.Tensor) -> torch.Tensor:
        """Standardise features, (M, features), in place and return them."""
        return features.sub_(self.mean).mul_(self.scale)  # new arrays of 30 MB would cost as much as products

    @torch.no_grad()
    def fold(self, layer: torch.nn.Linear) -> None:
        """Change a first layer of standardised features into that of the features as they are."""
        layer.weight.mul_(self.scale)
        layer.bias.sub_(layer.weight @ self.mean)


@torch.no_grad()
def measure(batches: Iterable[torch.Tensor]) -> Standardisation:
    """Return the standardisation of features, (M, features) per batch, at least one row."""
    count, total, squares = 0, 0.0, 0.0
    for batch in batches:
        values = batch.double()
        count, total, squares = count + len(values), total + values.sum(0), squares + values.square().sum(0)
    mean: Any = total / count
    variance: Any = squares / count - mean.square()
    scale = 1.0 / (variance.clamp(min=0.0) + MIN_VARIANCE).sqrt()
    return Standardisation(mean.float(), scale.float())
