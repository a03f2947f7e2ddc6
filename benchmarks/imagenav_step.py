"""Writes benchmarks/results/imagenav_step.json: an image-goal agent's time for a step."""

from pathlib import Path

from toponav.cli.bench import bench

if __name__ == "__main__":
    bench(only="imagenav", out=Path(__file__).parent / "results")
