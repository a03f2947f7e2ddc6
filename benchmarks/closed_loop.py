"""Writes benchmarks/results/closed_loop.json: real-time factor and memory of the closed loop."""

from pathlib import Path

from toponav.cli.bench import bench

if __name__ == "__main__":
    bench(only="closed_loop", out=Path(__file__).parent / "results")
