"""Names of the mappings that the package passes between its parts."""

from typing import Any, TypeAlias

import numpy as np

Arguments: TypeAlias = dict[str, Any]
"""Keyword arguments by name; whoever receives them checks them."""
Config: TypeAlias = dict[str, Any]
"""Configuration of an environment, as highway-env has it."""
Info: TypeAlias = dict[str, Any]
"""Info of one environment; in vector environments, arrays of shape (N,)."""
Observation: TypeAlias = dict[str, np.ndarray]
"""Observation of one environment: arrays by name."""
Values: TypeAlias = dict[str, Any]
"""Plain values by name, as in a JSON, TOML or YAML file: numbers, strings, lists and further mappings."""
