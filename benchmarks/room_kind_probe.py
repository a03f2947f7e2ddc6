"""Writes benchmarks/results/room_kind_probe.json: whether pictures tell what a room is for."""

from pathlib import Path

from toponav.evaluation.benchmarks.record import run_alone, write_benchmark
from toponav.evaluation.benchmarks.room_kind import measure_room_kind

if __name__ == "__main__":
    found = run_alone(measure_room_kind)
    path = write_benchmark(found, Path(__file__).parent / "results")
    print(f"{dict(found.metrics)}\nwritten: {path}")
