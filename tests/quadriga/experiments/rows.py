"""Rows of trials that nobody walked."""

from __future__ import annotations

from typing import Any

from quadriga.experiments.campaign.manifest import GroupEntry, Manifest, SweepEntry
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.recordings.traces import ERRORS


def row(variant: str = "none", seed: int = 0, **changes: Any) -> TrialOutcome:
    """A walk to the end; `fell` is the time of a fall, `error` sets every RMSE."""
    fell, error = changes.pop("fell", None), changes.pop("error", 0.01)
    upright = fell is None
    fields: dict[str, Any] = {
        "scenario": "steps", "variant": variant, "swept": (), "seed": seed,
        "config_sha256": "ab" * 32, "predictor_sha256": "", "refused": "", "success": upright,
        "fell": not upright, "time_to_fall_s": fell, "first_to_fall": "" if upright else "r2",
        "stopped": "", "mean_vx": 0.48, "distance_m": 3.0, "energy_j": 900.0,
        "cost_of_transport": 1.25, "control_cost": 1e6 * error**2, "planner_ms_p50": None,
        "planner_ms_p99": None, "solves": 0, "plans": "", "seconds": fell or 8.0, "wall_s": 4.0,
        "versions": "code 1",
    }  # fmt: skip
    errors = (name.replace("-", "_") for name in ERRORS)
    fields |= {f"rmse_{name}": error if upright else None for name in errors}
    return TrialOutcome(**fields | changes)


def manifest(*variants: str, sweeps: tuple[str, ...] = (), **changes: Any) -> Manifest:
    """Of a campaign of these variants on the ground `steps`, seeds 0 … 9."""
    swept = changes.pop("swept", ((),))
    groups = tuple(
        GroupEntry("steps", name, values, "ab" * 32, "", tuple(range(10)))
        for values in swept
        for name in variants
    )
    fields: dict[str, Any] = {
        "typed": ("quadriga campaign steps",), "baseline": variants[0],
        "variants": {name: {"planner.kind": name} for name in variants},
        "sweeps": tuple(SweepEntry(key, key) for key in sweeps), "groups": groups,
        "versions": "code 1",
    }  # fmt: skip
    return Manifest(**fields | changes)
