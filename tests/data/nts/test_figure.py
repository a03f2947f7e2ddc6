"""Pictures of labels show the numbers of the labels."""

from pathlib import Path

import numpy as np
import pytest

from tests.sim.two_rooms import two_rooms
from toponav.data.nts import panoramas
from toponav.data.nts.figure import column_of_direction, label_figure
from toponav.data.nts.labels import labels_of, score_of
from toponav.data.nts.panoramas import PanoramaConfig, collect_panoramas
from toponav.models.nts.panorama import column_yaw_rad


def test_columns_show_the_directions_of_their_rays() -> None:
    yaw = column_yaw_rad(512)
    for column in (0, 100, 255, 256, 400, 511):
        assert column_of_direction(float(yaw[column]), 512) == pytest.approx(
            column + 0.5, abs=0.01
        )


def test_picture_says_the_scores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(panoramas, "suite_scene", lambda generator, seed: two_rooms())
    config = PanoramaConfig(homes=1, panoramas=4, height=32, width=128)
    home = collect_panoramas(tmp_path, config)[0]
    labels = labels_of(home)
    source = int(labels.explorable.any(axis=1).argmax())
    guess = np.linspace(0.91, 0.99, 12, dtype=np.float32)
    for predicted, wanted in ((None, []), ([guess], guess[labels.explorable[source]].tolist())):
        figure = label_figure(home, [(source, 3)], predicted)
        said = {text.get_text() for axes in figure.axes for text in axes.texts}
        true = score_of(labels.via_m[source, 3])[labels.explorable[source]].tolist()
        assert said == {f"{score:.2f}" for score in [*true, *wanted]}
        figure.savefig(tmp_path / "labels.png")
