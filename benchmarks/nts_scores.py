"""Writes benchmarks/results/nts_scores.json and docs/images/nts-scores.png: what F_S is worth.

    toponav collect nts --suite homes-val --homes 4 --panoramas 48 --out runs/val
    python benchmarks/nts_scores.py runs/val

The picture's place and goals are chosen by what there is to choose, not by how well the network
does.
"""

import io
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
from PIL import Image

from toponav.data.nts.figure import label_figure
from toponav.data.nts.labels import labels_of, score_of
from toponav.data.nts.panoramas import HomePanoramas, open_panoramas
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.models.checkpoints import load_nts
from toponav.navigation.nts.perception import Perception
from toponav.training.nts_scores import measure_nts_scores

IMAGES = Path(__file__).parents[1] / "docs/images"
KINDS = ("kitchen", "bedroom", "living_room")


def choose(home: HomePanoramas) -> list[tuple[int, int]]:
    """The source from which the best ways to rooms of three kinds differ most, and a goal each."""
    labels = labels_of(home)
    rows, cols = home.ground.cells_of(home.poses[:, :2]).T
    kinds = [*home.rooms, ""]
    kind = np.array([kinds[number] for number in home.ground.room_index[rows, cols]])
    score = score_of(labels.via_m)
    best: tuple[float, list[tuple[int, int]]] = (-1.0, [])
    for source in range(len(home)):
        goals = [np.flatnonzero((kind == name) & ~labels.same_node[source]) for name in KINDS]
        if not labels.explorable[source].any() or not all(map(len, goals)):
            continue
        chosen = [int(one[np.argmax(score[source, one].max(axis=1))]) for one in goals]
        spread = float(np.std(score[source, chosen][:, labels.explorable[source]], axis=0).sum())
        best = max(best, (spread, [(source, goal) for goal in chosen]))
    return best[1]


def draw(home: HomePanoramas, path: Path) -> None:
    """Writes the picture."""
    perception = Perception(load_nts("nts", depth=True))
    pairs = choose(home)
    seen = {
        number: perception.see(
            np.array(home.rgb[number]), home.depth_mm[number] / np.float32(1000)
        )
        for pair in pairs
        for number in pair
    }
    scores = [perception.compare([seen[one]], seen[other]).score[0] for one, other in pairs]
    content = io.BytesIO()
    label_figure(home, pairs, scores).savefig(content)
    Image.open(content).convert("RGB").quantize(96).save(path, optimize=True)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    draw(open_panoramas(folder)[0], IMAGES / "nts-scores.png")
    config = open_panoramas(folder)[0].config
    metrics = measure_nts_scores(folder)
    found = Benchmark("nts_scores", metrics, asdict(config))
    written = write_benchmark(found, Path(__file__).parent / "results")
    print(f"{dict(found.metrics)}\nwritten: {written}")
