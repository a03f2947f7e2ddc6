"""Whether a picture tells what a room is for: a small network on panoramas of unseen homes.

This asks nothing of any agent. It checks the worlds: where such a network, trained for a minute,
cannot tell a kitchen from a bedroom in homes that it never saw, there is nothing to be learned.
"""

import itertools
from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor, nn

from toponav.core.camera import PanoramaCamera
from toponav.core.geometry import Pose2
from toponav.evaluation.benchmarks.record import Benchmark
from toponav.sim.render import make_renderer
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.suites import suite, suite_scene
from toponav.worlds.scene import Scene

__all__ = ["RoomKindNet", "measure_room_kind", "room_panoramas"]

_CAMERA = PanoramaCamera(height=64, width=256, mount_height_m=1.0)
_SHRINK = 2
_TRAIN, _TEST = "homes-train", "homes-test"


def measure_room_kind(
    train_homes: int = 30, test_homes: int = 14, per_room: int = 4, epochs: int = 40, seed: int = 0
) -> Benchmark:
    """Accuracy, chance and the confusion matrix on homes of the suite `homes-test`.

    Test homes hold furniture and surfaces that no training home has.

    Args:
        train_homes: How many homes of `homes-train` to learn from.
        test_homes: How many homes of `homes-test` to be judged in.
        per_room: Panoramas from random free places of each room.
        epochs: Passes over the training pictures.
        seed: Seed of places, headings and training.
    """
    rng = np.random.default_rng(seed)
    images, names = _pictures(_TRAIN, train_homes, per_room, rng)
    test_images, test_names = _pictures(_TEST, test_homes, per_room, rng)
    kinds = sorted(set(names.tolist()))
    kept = np.isin(test_names, kinds)
    labels = np.searchsorted(kinds, names)
    truth = np.searchsorted(kinds, test_names[kept])
    net = _train(images, labels, len(kinds), epochs, seed)
    with torch.inference_mode():
        guess = net(_as_input(test_images[kept])).argmax(dim=1).numpy()
    confusion = np.zeros((len(kinds), len(kinds)), int)
    np.add.at(confusion, (truth, guess), 1)
    totals = confusion.sum(axis=1)
    recall = confusion.diagonal()[totals > 0] / totals[totals > 0]
    return Benchmark(
        "room_kind_probe",
        {
            "accuracy": float((guess == truth).mean()),
            "balanced_accuracy": float(recall.mean()),
            "accuracy_of_the_commonest_kind": float(totals.max() / totals.sum()),
            "balanced_accuracy_of_chance": float(1 / (totals > 0).sum()),
        },
        {
            "building": f"{train_homes} homes of {_TRAIN}, {test_homes} of {_TEST}",
            "kinds": kinds,
            "confusion_rows_are_truth": confusion.tolist(),
            "train_pictures": len(images),
            "test_pictures": int(kept.sum()),
            "picture": f"RGB panorama {_CAMERA.height // _SHRINK}x{_CAMERA.width // _SHRINK}",
            "epochs": epochs,
            "seed": seed,
        },
    )


def room_panoramas(
    scene: Scene, per_room: int, rng: np.random.Generator
) -> tuple[UInt8[np.ndarray, "pictures height width 3"], list[str]]:
    """Colour panoramas from random free places of each room, and the rooms' kinds."""
    renderer = make_renderer(scene, _CAMERA)
    free = FreeSpace.of(scene, 0.25).free
    images, kinds = [], []
    for number, room in enumerate(scene.rooms):
        cells = np.argwhere(free & (scene.room_index == number))
        if not len(cells):
            continue
        for row, col in cells[rng.integers(len(cells), size=per_room)].tolist():
            pose = Pose2(*scene.grid.center_of(row, col), float(rng.uniform(-np.pi, np.pi)))
            rgb = renderer.render_images(pose, ("rgb",)).rgb
            assert rgb is not None
            shape = (_CAMERA.height // _SHRINK, _SHRINK, _CAMERA.width // _SHRINK, _SHRINK, 3)
            images.append(rgb.reshape(shape).mean(axis=(1, 3)).astype(np.uint8))
            kinds.append(str(room.kind))
    size = (_CAMERA.height // _SHRINK, _CAMERA.width // _SHRINK, 3)
    return np.array(images, np.uint8).reshape(-1, *size), kinds


class RoomKindNet(nn.Module):
    """Four convolutions that wrap around the panorama, and the mean over all places."""

    def __init__(self, kinds: int) -> None:
        super().__init__()
        widths = (3, 24, 48, 96, 96)
        self.convolutions = nn.ModuleList(
            nn.Conv2d(before, after, 3, stride=2) for before, after in itertools.pairwise(widths)
        )
        self.norms = nn.ModuleList(nn.GroupNorm(8, width) for width in widths[1:])
        self.head = nn.Linear(widths[-1], kinds)

    def forward(self, x: Float[Tensor, "batch 3 height width"]) -> Float[Tensor, "batch kinds"]:
        """A score of each kind."""
        for convolution, norm in zip(self.convolutions, self.norms, strict=True):
            x = nn.functional.pad(x, (1, 1, 0, 0), mode="circular")
            x = nn.functional.pad(x, (0, 0, 1, 1))
            x = torch.relu(norm(convolution(x)))
        scores: Float[Tensor, "batch kinds"] = self.head(x.mean(dim=(2, 3)))
        return scores


def _pictures(
    name: str, homes: int, per_room: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Panoramas of the first homes of a suite, and the kinds of their rooms."""
    images: list[np.ndarray] = []
    kinds: list[str] = []
    for seed in suite(name).seeds[:homes]:
        found, labels = room_panoramas(suite_scene("home", seed), per_room, rng)
        images.append(found)
        kinds += labels
    return np.concatenate(images), np.array(kinds)


def _train(
    images: UInt8[np.ndarray, "pictures height width 3"],
    labels: Int[np.ndarray, " pictures"],
    kinds: int,
    epochs: int,
    seed: int,
) -> RoomKindNet:
    """A network trained with turns and mirror images, rare kinds weighing more."""
    generator = torch.Generator().manual_seed(seed)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        net = RoomKindNet(kinds)
    x, y = _as_input(images), torch.from_numpy(labels.astype(np.int64))
    weight = 1.0 / torch.bincount(y, minlength=kinds).clamp(min=1).float()
    loss = nn.CrossEntropyLoss(weight / weight.mean(), label_smoothing=0.05)
    optimizer = torch.optim.AdamW(net.parameters(), lr=2e-3, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs)
    for _ in range(epochs):
        for chosen in torch.split(torch.randperm(len(x), generator=generator), 64):
            batch = _turned(x[chosen], generator)
            optimizer.zero_grad()
            loss(net(batch), y[chosen]).backward()
            optimizer.step()
        schedule.step()
    return net.eval()


def _turned(batch: Tensor, generator: torch.Generator) -> Tensor:
    """The pictures turned about the vertical, half of them mirrored, in other light."""
    turn = int(torch.randint(batch.shape[-1], (), generator=generator))
    batch = batch.roll(turn, dims=-1)
    if int(torch.randint(2, (), generator=generator)):
        batch = batch.flip(-1)
    light = 1 + 0.2 * (torch.rand(len(batch), 3, 1, 1, generator=generator) - 0.5)
    return batch * light


def _as_input(images: np.ndarray | Sequence[np.ndarray]) -> Float[Tensor, "n 3 height width"]:
    pixels = torch.from_numpy(np.asarray(images)).permute(0, 3, 1, 2).float()
    return pixels / 127.5 - 1.0
