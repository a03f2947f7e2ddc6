"""How to train: numbers a person may want to change, with a default for each preset."""

from dataclasses import dataclass, replace
from typing import Any, Literal

from toponav.core.errors import InputError

__all__ = ["Recipe", "TrainingConfig", "default_config"]

Recipe = Literal[
    "behaviors", "localization", "phasenet", "behavrnn", "pose", "judge", "steering", "nts", "il"
]

# Longer than nearly every edge (phasenet, 5 Hz) and nearly every drive (behavrnn).
_SEQUENCE_STEPS: dict[str, int] = {"phasenet": 100, "behavrnn": 210, "il": 64}


@dataclass(frozen=True)
class TrainingConfig:
    """One run of training; the same configuration, data and thread count repeat exactly.

    Two things depend on the clock: `precision="auto"` may pick another number format on
    another machine, and `max_minutes` shortens a run that would not fit.
    """

    epochs: int
    """Epochs to train each network for."""
    samples_per_epoch: int
    """Samples after which to validate and save."""
    batch_size: int
    learning_rate: float
    """Highest rate of the schedule."""
    weight_decay: float
    schedule: Literal["one_cycle", "constant"]
    """`one_cycle`: a short warm-up, then a cosine to zero."""
    ema: float
    """Decay of the moving average of the weights that is validated and kept; 0 for none."""
    mirror: bool
    """Whether half the samples are mirrored left to right."""
    seed: int = 0
    threads: int = 1
    """CPU threads. Results repeat exactly for the same number."""
    max_minutes: float | None = None
    """Fewer epochs are trained when they would take longer; the schedule ends on time."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """`auto` times both on this machine when training starts, and notes its choice."""
    warm_up: float = 0.05
    """Share of training over which the rate rises (`one_cycle`)."""
    largest_gradient: float = 5.0
    """Longer gradients are shortened to this norm."""
    most_validation_samples: int = 8192
    """Validation uses this many samples at most, the same ones each time."""
    sequence_steps: int = 20
    """Most steps of a training sequence, for recurrent networks."""
    most_repeats: int = 1
    """A set smaller than `samples_per_epoch` is gone through this often in an epoch at most."""
    plan_dropout: float = 0.2
    """Share of localization samples that are not told the plan."""

    def __post_init__(self) -> None:
        checks = {
            "epochs": 1 <= self.epochs <= 100_000,
            "samples_per_epoch": self.samples_per_epoch >= 1,
            "batch_size": 2 <= self.batch_size <= 65_536,
            "learning_rate": 0.0 < self.learning_rate <= 1.0,
            "weight_decay": 0.0 <= self.weight_decay <= 1.0,
            "ema": 0.0 <= self.ema < 1.0,
            "seed": 0 <= self.seed < 2**32,
            "threads": 1 <= self.threads <= 1024,
            "max_minutes": self.max_minutes is None or self.max_minutes > 0.0,
            "warm_up": 0.0 <= self.warm_up < 1.0,
            "most_validation_samples": self.most_validation_samples >= 2,
            "most_repeats": self.most_repeats >= 1,
            "sequence_steps": 1 <= self.sequence_steps <= 10_000,
            "plan_dropout": 0.0 <= self.plan_dropout <= 1.0,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy="leave it out to take the preset's value",
                )

    def with_changes(self, **changes: Any) -> "TrainingConfig":
        """This configuration with every change that is not None."""
        return replace(self, **{key: value for key, value in changes.items() if value is not None})


def default_config(preset: str, recipe: Recipe) -> TrainingConfig:
    """How a preset is trained unless told otherwise.

    `paper`: Adam at 1e-4, batches of 32, nothing else (section VI-C). `compact`: sized for
    twenty minutes a recipe on one CPU core, a dozen for each of the baselines. `best`: ten
    minutes a network on one quiet core.
    """
    steps = _SEQUENCE_STEPS.get(recipe, 20)
    if preset == "paper":
        return TrainingConfig(
            sequence_steps=steps,
            epochs=20,
            samples_per_epoch=1_000_000_000,
            batch_size=32,
            learning_rate=1e-4,
            weight_decay=0.0,
            schedule="constant",
            ema=0.0,
            mirror=False,
        )
    if recipe == "nts":
        return TrainingConfig(
            epochs=12,
            samples_per_epoch=12_800,
            batch_size=64,
            learning_rate=2e-3,
            weight_decay=0.03,
            schedule="one_cycle",
            ema=0.995,
            mirror=True,
            most_repeats=4,
            most_validation_samples=1280,
        )
    if recipe == "il":
        return TrainingConfig(
            epochs=8,
            samples_per_epoch=3_000,
            batch_size=16,
            learning_rate=1e-3,
            weight_decay=0.02,
            schedule="one_cycle",
            ema=0.99,
            mirror=True,
            most_repeats=4,
            largest_gradient=1.0,
            sequence_steps=steps,
        )
    if recipe == "judge":
        config = default_config(preset, "pose")
        return replace(config, epochs=8, samples_per_epoch=40_000, learning_rate=1.2e-3)
    if recipe in ("pose", "steering"):
        return TrainingConfig(
            epochs=10,
            samples_per_epoch=60_000,
            batch_size=256,
            learning_rate=2e-3,
            weight_decay=0.02,
            schedule="one_cycle",
            ema=0.998,
            mirror=True,
            most_validation_samples=4096,
        )
    if recipe in _SEQUENCE_STEPS:
        return TrainingConfig(
            epochs=12,
            samples_per_epoch=12_000 if recipe == "phasenet" else 3_600,
            batch_size=32 if recipe == "phasenet" else 8,
            learning_rate=1e-3,
            weight_decay=0.02,
            schedule="one_cycle",
            ema=0.995,
            mirror=True,
            most_repeats=4,
            largest_gradient=1.0,
            sequence_steps=steps,
            most_validation_samples=16_000 if recipe == "phasenet" else 40_000,
        )
    is_localization = recipe == "localization"
    return TrainingConfig(
        epochs=24 if is_localization else 12,
        samples_per_epoch=80_000 if is_localization else 60_000,
        batch_size=256,
        learning_rate=2e-3,
        weight_decay=0.02,
        schedule="one_cycle",
        ema=0.998,
        mirror=True,
        most_repeats=4,
    )
