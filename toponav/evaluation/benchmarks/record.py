"""What a benchmark found, with what is needed to judge it; and a process of its own to run in."""

import json
import multiprocessing
import os
import platform
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from toponav.evaluation.provenance import library_versions, source_commit
from toponav.evaluation.records import write_atomically

__all__ = ["Benchmark", "hardware", "peak_memory_mb", "run_alone", "write_benchmark"]

_THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


@dataclass(frozen=True)
class Benchmark:
    """Figures by name.

    Attributes:
        name: Name of the benchmark and of its file.
        metrics: Medians by name; the name ends in what it counts.
        settings: What was measured: building, seed, repeats, agent.
    """

    name: str
    metrics: Mapping[str, float]
    settings: Mapping[str, Any] = field(default_factory=dict)


def write_benchmark(benchmark: Benchmark, folder: Path) -> Path:
    """The JSON file written: commit, hardware, versions, settings, metrics."""
    document = {
        "schema": 1,
        "name": benchmark.name,
        "commit": source_commit(),
        "hardware": hardware(),
        "versions": library_versions(),
        "settings": dict(benchmark.settings),
        "metrics": {name: _rounded(value) for name, value in benchmark.metrics.items()},
    }
    path = folder / f"{benchmark.name}.json"
    write_atomically(path, (json.dumps(document, indent=2) + "\n").encode())
    return path


def _rounded(value: float) -> float:
    """Four digits: more would promise what a repeat does not keep."""
    return float(f"{value:.4g}")


def hardware() -> dict[str, Any]:
    """The processor and memory of this machine."""
    name = platform.processor() or platform.machine()
    cpu_info = Path("/proc/cpuinfo")
    if cpu_info.is_file():
        models = [line for line in cpu_info.read_text().splitlines() if "model name" in line]
        name = models[0].partition(":")[2].strip() if models else name
    return {
        "cpu": name,
        "cores": os.cpu_count(),
        "machine": platform.machine(),
        "system": platform.system(),
    }


def peak_memory_mb() -> float:
    """The most memory that this process has held so far."""
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # macOS counts bytes, everyone else kibibytes.
    return float(peak / 2**20 if sys.platform == "darwin" else peak / 2**10)


def run_alone(measure: Callable[..., Benchmark], *arguments: Any) -> Benchmark:
    """What `measure` finds in a fresh process with one thread per library.

    A fresh process has its own peak of memory, and libraries read the number of threads only
    once, when they load.
    """
    kept = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(1, mp_context=context) as pool:
            return pool.submit(measure, *arguments).result()
    finally:
        for name, value in kept.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
