"""A recording as arrays over world time: what summary and figures are computed from."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Any, Final

import numpy as np

from quadriga.recordings.events import merge_events, teller_of, tellers
from quadriga.recordings.gaps import Span
from quadriga.recordings.truth import Ticks, TruthTrace, build_truth_trace, stack, ticks_of
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.members import PLANNER, SIM, plant_name
from quadriga.shared.messages import (
    Consumed,
    Event,
    Measurement,
    Message,
    Plan,
    Reference,
    Status,
    Truth,
)
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import OUTPUTS, Array, robot_names, yoke_pairs
from quadriga.shared.topics import COMMAND, INPUTS, STATE, Topic, find_topic

# Up to 1 kHz each: only their ticks are read. What an agent took in is read of walks in real time,
# where it says which ticks the agent passed over.
_TIMED_ONLY: Final = (STATE.name, COMMAND.name, INPUTS.name)
# What a walk is judged by: the outputs by the world's truth, the height over the terrain under the
# hips, and the height over the stance feet, by the robot's own measurement: what it is asked to
# keep. Where a hip passes the edge of a block the former jumps, whatever the robot does.
OVER_STANCE_FEET: Final = "z-over-stance-feet"
ERRORS: Final = (OUTPUTS[0], OVER_STANCE_FEET, *OUTPUTS[1:])


@dataclass(frozen=True, slots=True)
class MeasurementTrace:
    """What one agent measured: ticks (M,), outputs (M, 6)."""

    tick: Ticks
    y: Array


@dataclass(frozen=True, slots=True)
class Traces:
    """Everything a recording tells, by world time.

    Attributes:
        config: the configuration of the run.
        metadata: the recording's metadata.
        robots: names r1 … rn.
        cut: where the recording was cut; empty if it is whole.
        messages: number of messages by key.
        invalid: number of messages by key that do not decode; of 1 kHz topics only the
            tick is looked at.
        ticks: ticks by key, in the order of the recording.
        log_times: log times of the first and the last state, ns, and None without states.
        references: ticks (R,) and values vx, vy, wz, height (R, 4), sorted.
        passed_over: ticks that each robot's agent, late in real time, says it passed over: spans
            from their first up to before their second.
        plants: what each robot's plant, in real time, says of itself (`quadriga.plant.deadlines`);
            one world says the same of all its robots.
        notes: what the recorder noted at the end, see `Recording.notes`.
    """

    config: Config
    metadata: Mapping[str, str]
    robots: tuple[str, ...]
    cut: str
    messages: Mapping[str, int]
    invalid: Mapping[str, int]
    ticks: Mapping[str, Ticks]
    log_times: tuple[int, int] | None
    truth: TruthTrace
    references: tuple[Ticks, Array]
    measurements: Mapping[str, MeasurementTrace]
    plans: Mapping[str, tuple[Plan, ...]]
    statuses: Mapping[str, tuple[Status, ...]]
    events: tuple[Event, ...]
    passed_over: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
    plants: Mapping[str, tuple[Status, ...]] = field(default_factory=dict)
    notes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def read_traces(
    recording: Recording, names: Container[str] | None = None, keys: Container[str] | None = None
) -> Traces:
    """Read a recording once.

    Args:
        recording: what to read.
        names: topics to look at, None for all.
        keys: keys to look at, None for all.

    Raises:
        RecordingError: the recording holds no message.
    """
    config = recorded_config(recording)
    robots = robot_names(config.team.robots)
    timed = _TIMED_ONLY if config.world.mode == "lockstep" else _TIMED_ONLY[:2]
    counts, invalid = Counter[str](), Counter[str]()
    ticks: defaultdict[str, list[int]] = defaultdict(list)
    decoded: defaultdict[tuple[type[Message], str], list[Any]] = defaultdict(list)
    place = cache(find_topic)
    log_times: tuple[int, int] | None = None
    for key, tick, log_time, payload in recording.entries(names, keys):
        counts[key] += 1
        topic, robot = place(key)
        if topic is None or tick < 0:
            invalid[key] += 1
            continue
        if topic.name not in timed:
            message = _decode_valid(payload, topic, config)
            if message is None:
                invalid[key] += 1
                continue
            decoded[topic.type, teller_of(topic, robot)].append(message)
        elif topic is STATE:
            log_times = (log_time if log_times is None else log_times[0], log_time)
        ticks[key].append(tick)
    _refuse_empty(recording, counts)
    return Traces(
        config=config,
        metadata=recording.metadata,
        robots=robots,
        cut=recording.cut,
        messages=dict(sorted(counts.items())),
        invalid=dict(sorted(invalid.items())),
        ticks={key: np.array(recorded, dtype=np.int64) for key, recorded in sorted(ticks.items())},
        log_times=log_times,
        truth=build_truth_trace(decoded[Truth, ""], config),
        references=_references(decoded[Reference, ""]),
        measurements={robot: _measurements(decoded[Measurement, robot]) for robot in robots},
        plans={robot: tuple(decoded[Plan, robot]) for robot in robots},
        statuses={name: tuple(decoded[Status, name]) for name in (*robots, PLANNER)},
        events=merge_events(decoded[Event, ""], [decoded[Event, who] for who in tellers(robots)]),
        passed_over={robot: _spans_passed_over(decoded[Consumed, robot]) for robot in robots},
        plants={
            robot: tuple(decoded[Status, SIM] or decoded[Status, plant_name(robot)])
            for robot in robots
        },
        notes=recording.notes,
    )


def _refuse_empty(recording: Recording, counts: Mapping[str, int]) -> None:
    if not counts:
        raise RecordingError(
            str(recording.path), "a recording without messages", "a walk", recording.cut
        )


def _decode_valid(payload: bytes, topic: Topic, config: Config) -> Message | None:
    """The message, None if its bytes are none or do not fit the team."""
    try:
        message = decode(payload, topic.type)
    except MessageError:
        return None
    return None if isinstance(message, Truth) and not _fits(message, config) else message


def in_force(references: tuple[Ticks, Array], tick: Ticks) -> Array:
    """The reference in force at each tick: the newest that starts no later.

    Returns:
        vx, vy, wz, height; shape (len(tick), 4), NaN where none was in force yet.
    """
    starts, values = references
    index = np.searchsorted(starts, tick, side="right") - 1
    padded = np.vstack([values.reshape(-1, 4), np.full((1, 4), np.nan)])
    return padded[index]


def demanded_outputs(traces: Traces, tick: Ticks) -> Array:
    """The outputs asked for at each tick. Shape (len(tick), 6), NaN where nothing was yet."""
    reference = in_force(traces.references, tick)
    demanded = np.zeros((len(tick), len(OUTPUTS)))
    demanded[:, [1, 2, 5, 0]] = reference
    demanded[np.isnan(reference).any(axis=1)] = np.nan
    return demanded


def tracking_errors(traces: Traces, begin: int, end: float = np.inf) -> tuple[Array, Array]:
    """True outputs from tick `begin` to tick `end`, and those less what was asked for.

    Returns:
        Both of shape (K, n, 6), of the K samples at which something was asked for.
    """
    truth = traces.truth
    demanded = demanded_outputs(traces, truth.tick)
    chosen = (begin <= truth.tick) & (truth.tick <= end) & np.isfinite(demanded[:, 0])
    return truth.y[chosen], truth.y[chosen] - demanded[chosen, None]


def estimate_errors(traces: Traces, index: int) -> tuple[Ticks, Array]:
    """What the agent at `index` estimated, less the truth at the same ticks.

    Returns:
        Ticks (K,) and errors (K, 6); that of the roll is the shorter way round, that of z NaN on
        uneven ground, where the one is a height over the stance feet, the other over the
        terrain under the hips.
    """
    own, truth = traces.measurements[traces.robots[index]], traces.truth
    tick, mine, true = np.intersect1d(own.tick, truth.tick, return_indices=True)
    error = own.y[mine] - truth.y[true, index]
    roll = OUTPUTS.index("roll")
    error[:, roll] = (error[:, roll] + np.pi) % (2 * np.pi) - np.pi
    if traces.config.world.uneven:
        error[:, OUTPUTS.index("z")] = np.nan
    return tick, error


def stance_height_errors(traces: Traces, robot: str, begin: int = 0, end: float = np.inf) -> Array:
    """A robot's height over its stance feet, as it measures it, less the one asked for.

    Returns:
        Errors (K,), m, of the samples from tick `begin` to tick `end` at which one was asked for.
    """
    own = traces.measurements[robot]
    error = own.y[:, OUTPUTS.index("z")] - in_force(traces.references, own.tick)[:, 3]
    return error[(begin <= own.tick) & (own.tick <= end) & np.isfinite(error)]


def _fits(truth: Truth, config: Config) -> bool:
    """Whether a truth message is about the team of the configuration."""
    team = config.team
    return (
        truth.robots == robot_names(team.robots)
        and len(truth.base_pos) == team.robots
        and len(truth.yoke_error) == len(yoke_pairs(team.robots, team.yokes))
    )


def _references(messages: Sequence[Reference]) -> tuple[Ticks, Array]:
    latest = {message.tick: message for message in messages}
    ordered = [latest[tick] for tick in sorted(latest)]
    values = [[r.vx, r.vy, r.wz, r.height] for r in ordered]
    return ticks_of(ordered), np.array(values, dtype=np.float64).reshape(-1, 4)


def _measurements(messages: Sequence[Measurement]) -> MeasurementTrace:
    return MeasurementTrace(ticks_of(messages), stack(messages, "y", 6))


def _spans_passed_over(messages: Sequence[Consumed]) -> tuple[Span, ...]:
    return tuple((m.tick - m.passed, m.tick) for m in messages if m.passed > 0)


def times_of(statuses: Sequence[Status], field: str) -> Array:
    """All that `planner_ms` or `tick_us` of some statuses hold, shape (K,)."""
    return np.concatenate([np.zeros(0), *(getattr(status, field) for status in statuses)])


def plan_times(statuses: Sequence[Status]) -> Array:
    """Wall times of planning steps but for the first of each process, ms, shape (K,).

    That one meets cold memory, and says nothing about the others.

    Args:
        statuses: of one agent or of the planner, in order; of several processes one after the
            other if it was started again.
    """
    begins = [0]
    for place, (before, status) in enumerate(pairwise(statuses), 1):
        # Counters begin anew with a process, and never fall within it.
        if any(status.counters.get(name, 0) < count for name, count in before.counters.items()):
            begins.append(place)
    processes = [statuses[begin:end] for begin, end in pairwise([*begins, len(statuses)])]
    return np.concatenate([np.zeros(0), *(times_of(one, "planner_ms")[1:] for one in processes)])


def mean_of(values: Array) -> float | None:
    """The mean, None of nothing."""
    return float(values.mean()) if values.size else None


def quantile_of(values: Array, q: float) -> float | None:
    """The q-quantile, None of nothing."""
    return float(np.quantile(values, q)) if values.size else None
