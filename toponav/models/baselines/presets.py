"""Sizes of the baselines' networks: `paper` and `compact`.

The paper says that PhaseNet is an LSTM trained with a mean squared error on the behaviour's
progress, and that BehavRNN is the sequence-to-sequence network of Sutskever et al. trained with
a softmax cross-entropy, given the image and the plan's behaviours (section VII). It gives no
sizes. Preset `paper` therefore takes those of the one CNN-LSTM that it does describe (figure 7,
table II: one frame, two layers of 512); `compact` takes the encoder of preset `compact`.
"""

from dataclasses import dataclass

from toponav.core.errors import InputError, did_you_mean
from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.presets import EncoderConfig, ImageSpec, get_preset

__all__ = ["BaselinePreset", "BehavRNNConfig", "PhaseNetConfig", "get_baseline_preset"]

_LARGEST = 8192


def _require(holds: bool, rule: str, where: str) -> None:
    if not holds:
        raise InputError(rule, where=where, remedy="start from get_baseline_preset('compact')")


def _check_recurrent(config: "PhaseNetConfig | BehavRNNConfig") -> None:
    where, offsets = type(config).__name__, config.frame_offsets
    _require(
        bool(offsets)
        and offsets[-1] == 0
        and list(offsets) == sorted(set(offsets), reverse=True)
        and offsets[0] < 1000,
        f"frame_offsets count down to 0, got {offsets}",
        where,
    )
    _require(
        1 <= config.recurrent_layers <= 8
        and 1 <= config.recurrent_size <= _LARGEST
        and 1 <= config.embedding <= _LARGEST,
        f"layers are 1..8 and widths 1..{_LARGEST}, got {config.recurrent_layers}, "
        f"{config.recurrent_size} and {config.embedding}",
        where,
    )


@dataclass(frozen=True)
class PhaseNetConfig:
    """The network that predicts how much of the present behaviour is done."""

    image: ImageSpec
    frame_offsets: tuple[int, ...]
    """Frames that it sees, as steps before now at 5 Hz: oldest first, 0 last."""
    encoder: EncoderConfig
    recurrent_layers: int
    recurrent_size: int
    embedding: int
    """Width of the embedding of the behaviour that is being executed."""
    finished_at: float
    """A behaviour is done when its phase reaches this."""

    def __post_init__(self) -> None:
        _check_recurrent(self)
        _require(
            0.0 < self.finished_at < 1.0,
            f"a behaviour is done at a phase between 0 and 1, got {self.finished_at}",
            "PhaseNetConfig",
        )


@dataclass(frozen=True)
class BehavRNNConfig:
    """The network from a plan's behaviours and images to the behaviour to execute."""

    image: ImageSpec
    frame_offsets: tuple[int, ...]
    """Frames that it sees, as steps before now at 5 Hz: oldest first, 0 last."""
    encoder: EncoderConfig
    recurrent_layers: int
    """Layers of the plan's reader and of the decoder, which starts in the reader's state."""
    recurrent_size: int
    embedding: int
    """Width of the embedding of each behaviour of the plan."""
    stride: int
    """It decides every this many control steps, so that a long drive is a shorter sequence."""
    reads_backwards: bool = True
    """Whether the plan's last behaviour is read first, as Sutskever et al. found better."""

    def __post_init__(self) -> None:
        _check_recurrent(self)
        _require(1 <= self.stride <= 100, f"stride is 1..100, got {self.stride}", "BehavRNNConfig")


@dataclass(frozen=True)
class BaselinePreset:
    """PhaseNet and BehavRNN for the image of GraphNav's preset of the same name."""

    name: str
    image: ImageSpec
    phasenet: PhaseNetConfig
    behavrnn: BehavRNNConfig


def get_baseline_preset(name: str) -> BaselinePreset:
    """The baselines' preset of this name: `compact` or `paper`.

    Raises:
        InputError: There is no such preset.
    """
    builders = {"compact": _compact, "paper": _paper}
    if name not in builders:
        raise InputError(
            f"the baselines have no preset {name!r}",
            where="--preset",
            remedy=did_you_mean(name, builders),
        )
    return builders[name]()


def _paper() -> BaselinePreset:
    described = get_preset("paper").behavior(Behavior.TURN_LEFT)
    image, encoder = described.image, described.encoder
    layers, size = described.recurrent_layers, described.recurrent_size
    return BaselinePreset(
        "paper",
        image,
        PhaseNetConfig(image, (0,), encoder, layers, size, embedding=64, finished_at=0.9),
        BehavRNNConfig(image, (0,), encoder, layers, size, embedding=64, stride=1),
    )


def _compact() -> BaselinePreset:
    described = get_preset("compact").behavior(Behavior.TURN_LEFT)
    image, encoder, offsets = described.image, described.encoder, described.frame_offsets
    return BaselinePreset(
        "compact",
        image,
        PhaseNetConfig(image, offsets, encoder, 1, 128, embedding=16, finished_at=0.85),
        BehavRNNConfig(image, offsets, encoder, 1, 160, embedding=32, stride=3),
    )
