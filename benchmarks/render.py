"""Writes benchmarks/results/render.json: frames a second of each depth camera."""

from pathlib import Path

from toponav.cli.bench import bench

if __name__ == "__main__":
    bench(only="render", out=Path(__file__).parent / "results")
