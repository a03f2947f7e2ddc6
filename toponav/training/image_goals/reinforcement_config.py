"""How to train the policies that learn from reward."""

from dataclasses import dataclass, replace
from typing import Any, Literal

from toponav.core.errors import InputError
from toponav.models.baselines.image_goal_presets import ImageGoalPresetName

__all__ = ["ReinforcementConfig", "reinforcement_config"]


@dataclass(frozen=True)
class ReinforcementConfig:
    """One run of proximal policy optimization (Schulman et al. 2017).

    Training goes in segments of `rollouts_a_segment` rollouts. Each begins with new episodes and
    random numbers of its own and ends with a checkpoint, so a run that was killed ends with the
    same weights as one that was not; `frames` may grow from one run to the next.
    """

    frames: int
    """Steps of the simulation to learn from; the paper's are 25 million."""
    robots: int = 16
    """Robots that are simulated at a time."""
    steps: int = 64
    """Steps of each robot between two updates of the policy."""
    rollouts_a_segment: int = 16
    """Rollouts between two checkpoints."""
    batch_size: int = 256
    epochs: int = 6
    """How often each frame is learned from."""
    learning_rate: float = 7e-4
    discount: float = 0.99
    trace: float = 0.95
    """Lambda of the generalized advantage."""
    clip: float = 0.2
    entropy: float = 0.01
    reward_scale: float = 0.2
    """Factor on the paper's reward, which is up to 10, where advantages are estimated."""
    stop_logit: float = -3.0
    """How little a new policy likes to stop: at random it would stop after four steps."""
    homes: int = 68
    """Homes of homes-train to run in."""
    near_m: float = 0.3
    """Shortest paths of training episodes are at least so long. Where a robot begins at its goal,
    less than a metre from it, it learns early what a goal looks like: elsewhere nineteen of twenty
    stops at random are wrong, and what is learned first is to stop at once."""
    far_m: float = 10.0
    """And in the end shorter than this."""
    first_far_m: float = 2.5
    """In the beginning shorter than this."""
    curriculum_frames: int = 300_000
    """Frames over which goals come to be as far as in the end."""
    max_steps: int = 200
    """Length of training episodes."""
    validation_episodes: int = 8
    """Episodes of homes-val of each difficulty that the policy runs after some segments."""
    validate_every: int = 4
    """Segments between two such measurements."""
    seed: int = 0
    precision: Literal["float32", "bfloat16"] = "float32"
    """Number format in which pictures are looked at; policies are updated in float32."""
    threads: int = 1
    """CPU threads of looking and of the policy's updates."""
    workers: int = 2
    """Processes that simulate; 0 simulates in the learner's own. Results do not depend on it."""
    max_minutes: float | None = None
    """Stop after the last segment that fits; the same command goes on."""

    def __post_init__(self) -> None:
        rollout = self.robots * self.steps
        checks = {
            "frames": self.frames >= 1,
            "robots": 1 <= self.robots <= 4096,
            "steps": 2 <= self.steps <= 100_000,
            "rollouts_a_segment": self.rollouts_a_segment >= 1,
            "batch_size": 2 <= self.batch_size <= rollout,
            "epochs": 1 <= self.epochs <= 100,
            "learning_rate": 0.0 < self.learning_rate <= 1.0,
            "discount": 0.0 <= self.discount < 1.0,
            "trace": 0.0 <= self.trace <= 1.0,
            "near_m": 0.0 < self.near_m < self.first_far_m <= self.far_m <= 100.0,
            "max_steps": 1 <= self.max_steps <= 100_000,
            "validation_episodes": 0 <= self.validation_episodes <= 100,
            "validate_every": self.validate_every >= 1,
            "seed": 0 <= self.seed < 2**31,
            "threads": 1 <= self.threads <= 1024,
            "workers": 0 <= self.workers <= 256,
            "max_minutes": self.max_minutes is None or self.max_minutes > 0.0,
        }
        for name, holds in checks.items():
            if not holds:
                raise InputError(
                    f"{name} is out of range, got {getattr(self, name)}",
                    where=f"--{name.replace('_', '-')}",
                    remedy="leave it out to take the preset's value",
                )

    @property
    def segment_frames(self) -> int:
        """Frames between two checkpoints."""
        return self.robots * self.steps * self.rollouts_a_segment

    def far_after(self, frames: int) -> float:
        """How far goals may be after so many frames."""
        share = min(1.0, frames / self.curriculum_frames)
        return self.first_far_m + share * (self.far_m - self.first_far_m)

    def with_changes(self, **changes: Any) -> "ReinforcementConfig":
        """This configuration with every change that is not None."""
        return replace(self, **{key: value for key, value in changes.items() if value is not None})


def reinforcement_config(preset: ImageGoalPresetName) -> ReinforcementConfig:
    """How a preset is trained unless told otherwise.

    `compact`: a million frames. `paper`: the paper's 25 million.
    """
    if preset == "paper":
        return ReinforcementConfig(
            frames=25_000_000,
            robots=32,
            steps=128,
            rollouts_a_segment=4,
            batch_size=512,
            epochs=3,
            learning_rate=2.5e-4,
            near_m=1.5,
            first_far_m=10.0,
            max_steps=500,
            validation_episodes=50,
            validate_every=10,
        )
    return ReinforcementConfig(frames=1_000_000)
