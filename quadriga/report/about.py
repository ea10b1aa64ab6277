"""The head of the page: scenario, seed, versions, configuration, and what was not recorded."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Final

import numpy as np

from quadriga.agents.planner.cooperation import is_cooperative
from quadriga.recordings.metadata import recorded_versions
from quadriga.report.run import ReportedRun
from quadriga.shared.codes import FALL
from quadriga.shared.config.reference_trace import ROW_END
from quadriga.shared.config.sections import Config
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.config.write import departures
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.topics import COMMAND, MEASUREMENT, PLAN, REFERENCE, STATE, STATUS, TRUTH

_DIGITS: Final = 12  # of a digest


def build_title(run: ReportedRun) -> str:
    """The run in one line."""
    config = run.traces.config
    n = config.team.robots
    yoked = "unyoked" if config.team.yokes == "none" else "yoked"
    who = f"{n} {yoked} robots" if n > 1 else "1 robot"
    return f"{who} on {_describe_ground(config)}, seed {config.world.seed}"


def judge(run: ReportedRun) -> tuple[str, bool]:
    """How it went in one line, and whether it went well."""
    falls = [entry for entry in run.timeline if entry.kind == FALL]
    if falls or run.summary["fell"]:
        when = ", ".join(f"{fall.robot} at {fall.tick / 1000:.2f} s" for fall in falls)
        return f"Fell: {when or ', '.join(run.summary['fallen'])}", False
    if run.summary["stop_reasons"]:
        reasons = (f"{robot}: {why}" for robot, why in run.summary["stop_reasons"].items())
        return f"Stopped: {'; '.join(reasons)}", False
    seconds = (run.end - run.begin) / 1000
    ended = run.summary["end"]
    return f"{seconds:.1f} s without a fall ({ended or 'no end was recorded'})", True


def list_facts(run: ReportedRun) -> Iterator[tuple[str, str]]:
    """Name and text of what identifies the run."""
    traces, config = run.traces, run.traces.config
    if traces.log_times:
        began = datetime.fromtimestamp(1e-9 * traces.log_times[0], UTC)
        yield "recorded", f"{began:%Y-%m-%d %H:%M:%S} UTC, {run.path.name}"
    else:
        yield "recorded", run.path.name
    yield "world time", f"{run.begin / 1000:.2f} … {run.end / 1000:.2f} s, {config.world.mode}"
    yield (
        "team",
        f"{config.team.name}: {', '.join(traces.robots)}, {config.robot.title}; "
        f"yokes {config.team.yokes}",
    )
    world = config.world
    if world.scenario:
        yield "scenario", world.scenario
    yield "ground", f"{_describe_ground(config)}, friction {world.friction:g}"
    if world.payload:
        yield "payload", f"{world.payload:g} kg on {world.payload_on}"
    if world.push:
        yield "pushes", world.push
    if world.push_force:
        yield (
            "pushes in turn",
            f"{world.push_force:g} N for {world.push_duration:g} s every {world.push_every:g} s",
        )
    if world.faults:
        yield "faults", world.faults
    if world.motor_strength:
        yield "weak motors", world.motor_strength
    asked = config.reference
    speeds = f"vx {asked.vx:g} m/s, vy {asked.vy:g} m/s, wz {asked.wz:g} rad/s"
    rows = asked.trace.count(ROW_END)
    yield "asked for", f"a trace of {rows} lines" if rows else speeds
    if config.team.agent_command:
        yield "controller", config.team.agent_command
    whose = ", for the team's cost" if is_cooperative(config) else ""
    yield "planner", f"{config.planner.kind}{whose}, {config.planner.interface}"
    digest = traces.metadata.get("predictor_sha256", "")
    kind = config.identification.predictor
    yield "predictor", f"{kind}, {digest[:_DIGITS]}" if digest else "none named"
    yield "estimator", config.estimator.kind
    yield "configuration", traces.metadata.get("config_sha256", "")[:_DIGITS] or "unnamed"
    versions = recorded_versions(traces.metadata)
    yield "versions", ", ".join(f"{k} {v}" for k, v in versions.items()) or "not recorded"


def list_changed_keys(config: Config) -> list[tuple[str, str, str, str]]:
    """Keys whose values are not the defaults: key, value, default, meaning with unit."""
    changed = []
    for name, value, usual, meta in departures(config, Config()):
        doc = meta["doc"] + ("" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]")
        changed.append((name, _format(value), _format(usual), doc))
    return changed


def describe_missing(run: ReportedRun) -> list[str]:
    """What the recording does not hold, and what the page leaves out for it; empty if whole."""
    traces, missing = run.traces, list[str]()
    names = {key.partition("/")[2].rpartition("/")[2] or key for key in traces.ticks}
    keys = {key.partition("/")[2] for key in traces.ticks}
    if TRUTH.name not in keys:
        missing.append(
            "No sim/truth, as of real robots: measured curves are the agents' own estimates, "
            "contacts are those of the foot sensors; true forces, yokes, paths and estimator "
            "errors are left out."
        )
    for topic, without in (
        (STATE, "tilt, contacts, slips and torques are left out"),
        (COMMAND, "nothing on this page is made of them, but they are missing"),
        (MEASUREMENT, "the agents' estimates are left out, the gait is the configured one"),
        (STATUS, "modes, stop reasons, solve times and ages are left out"),
        (REFERENCE, "what was asked for is not known"),
    ):
        if topic.name not in names and topic.name not in keys:
            missing.append(f"No {topic.name}: {without}.")
    if PLAN.name not in names and find_kind(traces.config.planner.kind).publishes:
        missing.append("No plan: planned curves are left out.")
    silent = [
        robot
        for robot in traces.robots
        if STATE.name in names and STATE.key(traces.config.team.name, robot) not in traces.ticks
    ]
    if silent:
        missing.append(f"Nothing of the sensors of {', '.join(silent)}.")
    if run.begin > 0:
        missing.append(f"The recording begins at {run.begin / 1000:.2f} s.")
    if traces.cut:
        missing.append(f"The recording is cut: {traces.cut}. Everything before is shown.")
    elif not run.complete:
        missing.append("The recording was not finished: its recorder was killed or lost its disk.")
    return missing


def list_traffic(run: ReportedRun) -> list[tuple[str, ...]]:
    """A row for each key: messages, rate, first and last tick, missing and invalid ones."""
    traces = run.traces
    rows: list[tuple[str, ...]] = []
    gaps = run.summary["gaps_per_topic"]
    for key, count in traces.messages.items():
        ticks = traces.ticks.get(key, np.zeros(0, dtype=np.int64))
        seconds = (int(ticks.max()) - int(ticks.min())) / 1000 if len(ticks) else 0.0
        rate = f"{(len(ticks) - 1) / seconds:.1f}" if seconds > 0 else "–"
        span = f"{ticks.min() / 1000:.2f} … {ticks.max() / 1000:.2f}" if len(ticks) else "–"
        missing = str(gaps[key]) if key in gaps else "–"
        rows.append((key, f"{count:,}", rate, span, missing, str(traces.invalid.get(key, 0))))
    return rows


def _describe_ground(config: Config) -> str:
    world = config.world
    return world.ground if TERRAINS[world.terrain].builder else f"{world.ground} ground"


def _format(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(f"{item:g}" for item in value)
    return str(value) if str(value) else "(empty)"
