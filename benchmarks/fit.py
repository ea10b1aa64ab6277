"""Time and memory of the predictor's fits on random data, of the sizes that large teams need.

Each fit runs in a process of its own, whose peak memory is the fit's.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import PredictorMeta, fit
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS
from quadriga.shared.runtime.clock import monotonic

EPISODE = 1050  # samples of one walk


class Size(NamedTuple):
    """A team's data, and what its fit may cost on two cores."""

    robots: int
    samples: int
    seconds: float
    gigabytes: float


SIZES = (
    Size(3, 5_250, 1.0, np.inf), Size(5, 12_000, 3.0, 0.5), Size(10, 20_000, 12.0, np.inf),
)  # fmt: skip


def random_episodes(robots: int, samples: int) -> list[Episode]:
    """Data of white forces and white outputs: they make no fit faster, and no fit useful."""
    rng = np.random.default_rng(0)
    episodes = []
    for start in range(0, samples, EPISODE):
        shape = (min(EPISODE, samples - start), robots)
        u, y = rng.normal(size=(*shape, N_FORCES)), 0.1 * rng.normal(size=(*shape, N_OUTPUTS))
        episodes.append(Episode(10.0 * u, np.zeros_like(u), y, np.zeros_like(y), first_tick=310))
    return episodes


def measure(robots: int, samples: int) -> dict[str, Any]:
    """Fit once by ridge regression: time, and peak memory of this process, GB."""
    config = load(None, {"team.robots": robots, "identification.predictor": "ridge"})
    meta, episodes = PredictorMeta.of(config), random_episodes(robots, samples)
    begun = monotonic()
    fit(episodes, meta)
    seconds = monotonic() - begun
    return {"robots": robots, "samples": samples, "seconds": seconds, "peak_gb": _peak_gb()}


def _peak_gb() -> float:
    """Largest resident memory of this process so far; `getrusage` would count its parent's."""
    rows = Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines()
    fields = {name: value.split() for name, _, value in (row.partition(":") for row in rows)}
    return 1024e-9 * int(fields["VmHWM"][0])
