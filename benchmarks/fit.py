"""Time and memory of the predictor's fits on random data, of the sizes that large teams need.

Each fit runs in a process of its own, whose peak memory is the fit's. Budgets of the default:
n = 5, T = 12,000 in 3 s and 0.5 GB; n = 10, T = 20,000 in 12 s (two cores).

On a busy machine two BLAS threads wait for each other and one thread is faster:
OMP_NUM_THREADS=1 python -m benchmarks.fit

Run: python -m benchmarks.fit [--out FILE] [--kinds ridge pinv …] [--sizes 5 10] [--repeats 3]
"""

from __future__ import annotations

import argparse
import json
import os
import resource
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.children import result_of
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import KINDS, PredictorMeta, fit
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS
from quadriga.shared.runtime.clock import monotonic

EPISODE = 1050  # samples of one walk


@dataclass(frozen=True)
class Size:
    """A team's data and what the default fit may cost on two cores."""

    robots: int
    samples: int
    seconds: float
    gigabytes: float | None


SIZES = (Size(3, 5_250, 1.0, None), Size(5, 12_000, 3.0, 0.5), Size(10, 20_000, 12.0, None))


def random_episodes(robots: int, samples: int) -> list[Episode]:
    """Data of white forces and white outputs: they make no fit faster, and no fit useful."""
    rng = np.random.default_rng(0)
    episodes = []
    for start in range(0, samples, EPISODE):
        shape = (min(EPISODE, samples - start), robots)
        u, y = rng.normal(size=(*shape, N_FORCES)), 0.1 * rng.normal(size=(*shape, N_OUTPUTS))
        episodes.append(Episode(10.0 * u, np.zeros_like(u), y, np.zeros_like(y), first_tick=310))
    return episodes


def measure(robots: int, samples: int, kind: str) -> dict[str, Any]:
    """Fit once: wall and processor time, and peak memory of this process."""
    config = Config()
    identification = replace(config.identification, predictor=kind)
    config = replace(
        config, team=replace(config.team, robots=robots), identification=identification
    )
    meta, episodes = PredictorMeta.of(config), random_episodes(robots, samples)
    used, begun = processor_time(), monotonic()
    fit(episodes, meta)
    seconds, used = monotonic() - begun, processor_time() - used
    return {
        "robots": robots, "samples": samples, "kind": kind, "seconds": seconds,
        "processor_seconds": used, "peak_gb": peak_gb(),
    }  # fmt: skip


def processor_time() -> float:
    """Seconds of processor time of this process so far, all its threads, user and system."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def peak_gb() -> float:
    """Largest resident memory of this process so far, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9


def main() -> None:
    """Measure, print a table and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="JSON file to write")
    parser.add_argument("--kinds", nargs="+", default=["ridge"], choices=sorted(KINDS))
    parser.add_argument("--sizes", nargs="+", type=int, default=[s.robots for s in SIZES])
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    print(
        f"{'n':>3} {'T':>6} {'fit':8} {'best s':>8} {'all':24} {'CPU s':>7} {'peak GB':>8}  budget"
    )
    rows = []
    for size in (s for s in SIZES if s.robots in arguments.sizes):
        for kind in arguments.kinds:
            runs = [
                result_of(measure, size.robots, size.samples, kind)
                for _ in range(arguments.repeats)
            ]
            best = min(run["seconds"] for run in runs)
            used = min(run["processor_seconds"] for run in runs)
            peak = max(run["peak_gb"] for run in runs)
            every = " ".join(f"{run['seconds']:.2f}" for run in runs)
            within = best <= size.seconds and peak <= (size.gigabytes or np.inf)
            verdict = ("kept" if within else "MISSED") if kind == "ridge" else "-"
            print(
                f"{size.robots:3} {size.samples:6} {kind:8} {best:8.2f} {every:24} "
                f"{used:7.2f} {peak:8.2f}  {verdict}",
                flush=True,
            )
            rows += runs
    if arguments.out:
        report = {
            "runs": rows,
            "load": os.getloadavg(),
            "cores": os.cpu_count(),
            "blas_threads": os.environ.get("OMP_NUM_THREADS", "all"),
            "budgets": [asdict(size) for size in SIZES],
        }
        arguments.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
