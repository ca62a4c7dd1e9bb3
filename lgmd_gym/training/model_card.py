"""The model card of a training run: `README.md` in the format of the Hugging Face Hub."""

import csv
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.processes.files import complete_file
from lgmd_gym.training.config import TrainConfig
from lgmd_gym.training.hyperparams import TIME_TO_BRAKE

FILE = "README.md"

_PAGE = """# {algo} policy for {env_id}

A policy that decides when a car brakes, trained with lgmd-gym {version} and stable-baselines3.
Its inputs: {inputs}.

## Evaluation

{evaluation}

## Use

lgmd-gym reads the weights and unpickles nothing. stable-baselines3 (`load`) unpickles the file, which can run
any code: use it only with files from sources you trust.

```bash
lgmd-gym bench --suite r152 --agents policy:policy.zip
```

```python
from lgmd_gym.agents import make_agent

agent = make_agent("policy:policy.zip")
print(agent.agent.card)
```

## Training

{start}```yaml
{config}```
"""
_START = """It starts from the network of another policy, which this folder does not contain. The card in the
file has its training as `start`.

"""


class EvaluationResult(NamedTuple):
    """The best evaluation of a training run on the validation split."""

    mean: float  # mean return
    std: float  # standard deviation over episodes
    episodes: int  # number of episodes

    def __str__(self) -> str:
        return f"{self.mean:.2f} +/- {self.std:.2f}"


class EpochResult(NamedTuple):
    """The best epoch of a training run on recorded episodes, on those of the validation split."""

    loss: float  # mean cross-entropy
    area: float | None  # area under the ROC curve, see `StateEvaluation`; None without both outcomes

    def __str__(self) -> str:
        loss = f"loss {self.loss:.3f}"
        return loss if self.area is None else f"{loss}, area under the ROC curve {self.area:.4f}"


def write_model_card(config: TrainConfig, folder: Path, version: str) -> None:
    """Write the model card of a finished training run into its folder."""
    import yaml

    result, epoch = best_result(folder), best_epoch(folder)
    text = "The training had no evaluation."
    if result is not None:
        text = f"Best evaluation: mean return {result} over {result.episodes} episodes of `validation`."
    elif epoch is not None:
        text = f"Best epoch, on the decisions of the recorded episodes of `validation`: {epoch}."
    page = _PAGE.format(
        algo=config.algo.upper(),
        env_id=config.env_id,
        version=version,
        inputs=", ".join(f"`{name}`" for name in config.features.inputs),
        evaluation=text,
        start="" if config.start is None else _START,
        config=yaml.safe_dump(_shown(config), sort_keys=False),
    )
    metadata = yaml.safe_dump(_metadata(config, result), sort_keys=False)
    with complete_file(folder / FILE) as part:
        part.write_text(f"---\n{metadata}---\n\n{page}", encoding="utf-8")


def best_result(folder: Path) -> EvaluationResult | None:
    """Return the evaluation with the highest mean return; None without one, as on recorded episodes."""
    file = folder / "best" / "evaluations.npz"
    if not file.exists():
        return None
    with np.load(file) as log:
        results = log["results"]
    best = results[results.mean(axis=1).argmax()]
    return EvaluationResult(float(best.mean()), float(best.std()), best.size)


def best_epoch(folder: Path) -> EpochResult | None:
    """Return the epoch with the lowest loss in a training folder; None without one, as of `DQN`."""
    file = folder / "log" / "progress.csv"
    if not file.exists():
        return None
    with file.open(encoding="utf-8", newline="") as lines:
        rows = [row for row in csv.DictReader(lines) if row.get("loss")]
    best = min(rows, key=lambda row: float(row["loss"]), default=None)
    if best is None:
        return None
    area = best.get("area")
    return EpochResult(float(best["loss"]), float(area) if area else None)


def _metadata(config: TrainConfig, result: EvaluationResult | None) -> Values:
    """Return the YAML metadata of the Hub."""
    kinds = ["reinforcement-learning", "deep-reinforcement-learning"]
    if config.algo == TIME_TO_BRAKE:
        kinds = ["supervised-learning"]
    metadata: Values = {
        "library_name": "stable-baselines3",
        "tags": [*kinds, "stable-baselines3", config.env_id],
    }
    if result is not None:
        entry = {
            "task": {"type": "reinforcement-learning", "name": "reinforcement-learning"},
            "dataset": {"name": config.env_id, "type": config.env_id},
            "metrics": [
                {"type": "mean_reward", "value": str(result), "name": "mean_reward", "verified": False}
            ],
        }
        metadata["model-index"] = [{"name": config.algo.upper(), "results": [entry]}]
    return metadata


def _shown(config: TrainConfig) -> Values:
    """Return the configuration without local paths, and without cameras, which the policy contains."""
    values = config.to_dict()
    return {
        name: list(cast(tuple[object, ...], value)) if isinstance(value, tuple) else value
        for name, value in values.items()
        if name not in ("camera", "recordings", "start")
    }
