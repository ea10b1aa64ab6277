"""The figures of merit of a finished run, from its recording alone."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isnan
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.recordings.falls import find_falls
from quadriga.recordings.gaps import end_of_world, missing_ticks, repeated_ticks
from quadriga.recordings.metadata import recorded_versions
from quadriga.recordings.stops import find_stops
from quadriga.recordings.traces import (
    ERRORS,
    OVER_STANCE_FEET,
    Traces,
    estimate_errors,
    mean_of,
    plan_times,
    quantile_of,
    read_traces,
    stance_height_errors,
    times_of,
    tracking_errors,
)
from quadriga.recordings.truth import distance
from quadriga.shared.codes import FALL, code_of
from quadriga.shared.messages import Status
from quadriga.shared.recording.metadata import END, LOST, RECORDING
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import OUTPUTS, Array
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.histogram import QUANTILES
from quadriga.shared.topics import COMMAND, STATE

__all__ = ["RECORDING", "SUMMARY", "kept_summary", "steady_from", "summarise", "summary_of"]

SUMMARY: Final = "summary.json"
SETTLING_MS: Final = 1000  # after the speed ramp's end, until the steady part begins


def summarise(run_dir: Path, traces: Traces | None = None) -> dict[str, Any]:
    """Compute the figures of the run in `run_dir`, write them to `summary.json`, return them.

    `traces` are those of its recording, if that has been read already.

    Lengths in m, speeds in m/s, angles in rad, world time in s. A figure that the recording does
    not hold (no planner, a walk too short for a steady part) is None. Tracking errors, mean speeds
    and estimator errors are over the steady part: from `steady_from`, 1 s after the speed ramp's
    end, to the end, all robots together. Times of planning steps are wall time, without the
    first of each process; `planner_solves` counts all of them.

    Raises:
        RecordingError: there is no recording, or it is empty or foreign.
    """
    summary = summary_of(traces or read_traces(Recording(run_dir / RECORDING)))
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    write_text(run_dir / SUMMARY, text + "\n")
    return summary


def kept_summary(recording: Recording) -> dict[str, Any] | None:
    """What `summarise` has written of this recording; None if it has not, or of another one."""
    if recording.path.name != RECORDING:
        return None
    path = recording.path.with_name(SUMMARY)
    try:
        newer = path.stat().st_mtime_ns >= recording.path.stat().st_mtime_ns
        found = json.loads(path.read_text(encoding="utf-8")) if newer else None
    except (OSError, ValueError, RecursionError):  # the last for what nests too deeply
        return None
    if not isinstance(found, dict):
        return None
    same = found.get("config_sha256") == recording.metadata.get("config_sha256")
    return found if same else None


def summary_of(traces: Traces) -> dict[str, Any]:
    """The figures of a run, ready for JSON."""
    config, metadata = traces.config, traces.metadata
    return {
        **_world(traces),
        **_tracking(traces),
        **_estimator(traces),
        **_agents(traces),
        **_deadlines(traces),
        **_traffic(traces),
        "team": config.team.name,
        "robots": config.team.robots,
        "yokes": config.team.yokes,
        "seed": config.world.seed,
        "mode": config.world.mode,
        "scenario": config.world.scenario,
        "terrain": config.world.terrain,
        "planner": config.planner.kind,
        "controller": config.team.agent_command,
        "estimator": config.estimator.kind,
        "config_sha256": metadata.get("config_sha256", ""),
        "predictor_sha256": metadata.get("predictor_sha256", ""),
        "versions": recorded_versions(metadata),
    }


def steady_from(traces: Traces) -> int:
    """First tick of the steady part, ms: `SETTLING_MS` after full speed was asked for."""
    config = traces.config
    starts, values = traces.references
    target = [config.reference.vx, config.reference.vy, config.reference.wz]
    full = starts[np.abs(values[:, :3] - target).max(axis=1, initial=0.0) < 1e-6]
    ramp_end = config.gait.stand_ms + round(1000 * config.reference.ramp)
    begin = int(full[0]) if len(full) and not config.reference.trace else ramp_end
    return max(begin, config.gait.stand_ms) + SETTLING_MS


def _world(traces: Traces) -> dict[str, Any]:
    truth, fallen = traces.truth, set(find_falls(traces))
    if not len(truth.tick):  # then the robots' own word must do
        fallen |= {
            r
            for r, statuses in traces.statuses.items()
            if any(code_of(s.reason) == FALL for s in statuses)
        }
    end = next((event for event in reversed(traces.events) if event.kind == "stop"), None)
    vanished = traces.notes.get(END, {})
    return {
        "fell": bool(fallen),
        "fallen": sorted(fallen),
        "distance": distance(truth, 2 * traces.config.gait.stance_ms),
        "end": end.detail if end is not None else vanished.get("detail", ""),
        "end_code": end.code if end is not None else vanished.get("code", ""),
        "yoke_drift_max": float(np.abs(truth.yoke_error).max(initial=0.0)),
        "events": [
            {"tick": e.tick, "kind": e.kind, "code": e.code, "robot": e.robot, "detail": e.detail}
            for e in traces.events
        ],
    }


def _tracking(traces: Traces) -> dict[str, Any]:
    begin = steady_from(traces)
    y, error = tracking_errors(traces, begin)
    heights = [stance_height_errors(traces, robot, begin) for robot in traces.robots]
    return {
        "steady_from": begin / 1000.0,
        **{f"mean_{name}": mean_of(y[..., OUTPUTS.index(name)]) for name in ("vx", "vy", "wz")},
        "rmse": _with_height(_rmse(error), np.concatenate(heights)),
        "rmse_per_robot": {
            robot: _with_height(_rmse(error[:, i : i + 1]), heights[i])
            for i, robot in enumerate(traces.robots)
        },
    }


def _estimator(traces: Traces) -> dict[str, Any]:
    """Error of the agents' own outputs against truth at the same tick, steady part.

    None of what cannot be compared (`quadriga.recordings.traces.estimate_errors`).
    """
    begin, errors = steady_from(traces), []
    for i in range(len(traces.robots)):
        tick, error = estimate_errors(traces, i)
        errors.append(error[tick >= begin])
    rmse = _rmse(np.concatenate(errors)[:, None])
    return {"estimator_rmse": {k: None if v is None or isnan(v) else v for k, v in rmse.items()}}


def _agents(traces: Traces) -> dict[str, Any]:
    statuses = traces.statuses
    last = {robot: found[-1] for robot, found in statuses.items() if found}
    every = [status for found in statuses.values() for status in found]
    planner_ms = np.concatenate([plan_times(found) for found in statuses.values()])
    tick_us = times_of(every, "tick_us")
    return {
        "planner_solves": len(times_of(every, "planner_ms")),
        "planner_ms_median": quantile_of(planner_ms, 0.5),
        "planner_ms_p99": quantile_of(planner_ms, 0.99),
        "tick_us_median": quantile_of(tick_us, 0.5),
        "tick_us_p99": quantile_of(tick_us, 0.99),
        "counters": {robot: dict(status.counters) for robot, status in last.items()},
        "stop_reasons": find_stops(traces),
    }


def _deadlines(traces: Traces) -> dict[str, Any]:
    """In real time what came late, by robot and of the world; else None."""
    plants = {robot: statuses[-1] for robot, statuses in traces.plants.items() if statuses}
    if not plants:
        return {"realtime": None}
    lead = next(iter(plants.values()))
    by_member: dict[str, Any] = {
        "world": {"jitter_ms": _spread(lead, "jitter"), "overruns": lead.counters.get("overruns")}
    }
    for robot, sim_status in plants.items():
        own, ticks = traces.statuses[robot], sim_status.counters.get("ticks", 0)
        ticks = sim_status.counters.get(f"{robot}.due", ticks)
        late = sim_status.counters.get(f"{robot}.late", 0)
        by_member[robot] = {
            "late": late,
            "late_share": late / ticks if ticks else None,
            "held": sim_status.counters.get(f"{robot}.held", 0),
            "command_age_ms": _spread(sim_status, f"{robot}.command"),
            "jitter_ms": _spread(own[-1], "jitter") if own else {},
        }
    return {"realtime": by_member}


def _spread(status: Status, name: str) -> dict[str, float]:
    return {
        key: status.ages_ms[f"{name}.{key}"]
        for key in (*QUANTILES, "max")
        if f"{name}.{key}" in status.ages_ms
    }


def _traffic(traces: Traces) -> dict[str, Any]:
    gaps = missing_ticks(traces.config, traces.ticks, traces.statuses, traces.passed_over)
    team, nothing = traces.config.team.name, np.zeros(0, dtype=np.int64)
    states = [traces.ticks.get(STATE.key(team, robot), nothing) for robot in traces.robots]
    ticks = np.concatenate(states)
    ticks = ticks[ticks <= end_of_world(traces.config)]
    world = int(np.ptp(ticks)) / 1000.0 if len(ticks) else 0.0
    first, last = traces.log_times or (0, 0)
    return {
        "duration": world,
        "real_time_factor": world / ((last - first) / 1e9) if last > first else None,
        "messages": sum(traces.messages.values()),
        "messages_per_topic": dict(traces.messages),
        "lost": _count_lost(traces),
        "gaps": sum(gaps.values()),
        "gaps_per_topic": gaps,
        "repeated": repeated_ticks(traces.ticks),
        "invalid": sum(traces.invalid.values()),
        "invalid_per_topic": dict(traces.invalid),
        "cut": traces.cut,
    }


def _count_lost(traces: Traces) -> int:
    """Messages that the recorder missed; a controller of one's own need not answer every tick."""
    lost = traces.notes.get(LOST, {})
    foreign = f"/{COMMAND.name}" if traces.config.team.agent_command else " "
    return sum(int(count) for key, count in lost.items() if not key.endswith(foreign))


def _rmse(error: Array) -> dict[str, float | None]:
    """Root mean square over samples and robots of errors of shape (T, n, 6), by output."""
    return {name: _root(mean_of(error[..., i] ** 2)) for i, name in enumerate(OUTPUTS)}


def _with_height(rmse: Mapping[str, float | None], errors: Array) -> dict[str, float | None]:
    """RMSE by name of `ERRORS`, with that of the height over the stance feet."""
    every = {**rmse, OVER_STANCE_FEET: _root(mean_of(errors**2))}
    return {name: every[name] for name in ERRORS}


def _root(value: float | None) -> float | None:
    return None if value is None else value**0.5
