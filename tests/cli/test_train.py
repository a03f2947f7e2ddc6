import json
from pathlib import Path

import pytest

from tests.training.synthetic import SyntheticSet
from toponav.cli import train
from toponav.cli._training import ScheduleFlags
from toponav.core.errors import InputError
from toponav.data.training_set import TrainingSet
from toponav.training import recipes
from toponav.training.loop import TrainingResult


def test_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="toponav data prepare"):
        train.localization(data=(tmp_path / "none",), out=tmp_path / "out")


def test_command_trains_and_prints_json(tmp_path, monkeypatch, capsys):
    data = SyntheticSet(trajectories=4, frames_an_edge=3)
    monkeypatch.setattr(TrainingSet, "open", staticmethod(lambda paths: data))
    schedule = ScheduleFlags(epochs=1, batch_size=16)
    arguments = {"data": (tmp_path,), "out": tmp_path / "out", "schedule": schedule}
    assert train.localization(**arguments, json=True) == 0
    (record,) = json.loads(capsys.readouterr().out)
    assert record["name"] == "localization"
    assert Path(record["checkpoint"]).is_file()
    assert train.localization(**arguments) == 0
    assert "weights are in" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["phasenet", "behavrnn"])
def test_baselines_are_trained_from_the_command_line(tmp_path, monkeypatch, capsys, name):
    data = SyntheticSet(trajectories=4, frames_an_edge=3)
    monkeypatch.setattr(TrainingSet, "open", staticmethod(lambda paths: data))
    command = train.register()["train", name]
    schedule = ScheduleFlags(epochs=1, batch_size=8, precision="float32")
    options = {"schedule": schedule, "json": True}
    assert command(data=(tmp_path,), out=tmp_path / "out", **options) == 0
    (record,) = json.loads(capsys.readouterr().out)
    assert record["name"] == name
    assert Path(record["checkpoint"]).is_file()
    assert (tmp_path / "out" / f"run_{name}.json").is_file()


@pytest.mark.parametrize(
    ("baselines", "minutes"), [(True, [3.0, 3.0, 2.0, 2.0]), (False, [5.0, 5.0])]
)
def test_everything_is_trained_in_the_time_given(
    tmp_path, monkeypatch, capsys, baselines, minutes
):
    given = []
    monkeypatch.setattr(TrainingSet, "open", staticmethod(lambda paths: None))
    for name in ("behaviors", "localization", "phasenet", "behavrnn"):

        def stand_in(data, preset, config, out, *, report=None, name=name):
            given.append(config.max_minutes)
            result = TrainingResult(name, out / name, {}, 1, 1, 60.0, "float32")
            return [result] if name == "behaviors" else result

        monkeypatch.setattr(recipes, f"train_{name}", stand_in)
    options = {"max_minutes": 10.0, "baselines": baselines, "json": True}
    assert train.everything(data=(tmp_path,), out=tmp_path, **options) == 0
    assert given == pytest.approx(minutes)
    names = [record["name"] for record in json.loads(capsys.readouterr().out)]
    assert names == ["behaviors", "localization", "phasenet", "behavrnn"][: len(minutes)]


def test_commands_have_help_with_an_example():
    for command in train.register().values():
        assert "Example: toponav train" in command.__doc__
