"""SHELL of `quadriga replay --from`: the question, a bar while the branch walks, the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.progress import build_progress
from quadriga.recordings.truth import ticks_of
from quadriga.replay.config_changes import change_config, format_changes
from quadriga.replay.own_agents import require_own_agents
from quadriga.replay.recorded_predictor import find_predictor
from quadriga.replay.world_replay import read_computable_config
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Event, Truth
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.tables import Table
from quadriga.warm_up import warm_up
from quadriga.what_if.branch import Change, walk_branch
from quadriga.what_if.figure import draw_branch
from quadriga.what_if.outcome import build_course, build_what_if_table

_SHOWN: Final = 100  # ticks between looks at the bar


@dataclass(frozen=True, slots=True)
class WhatIf:
    """What a user asks of a recorded walk.

    Attributes:
        path: the recording.
        seconds: from when on something is different, s of world time.
        given: configuration keys to change, by section and key.
        predictor: a predictor's file instead of the recorded one's.
        robots: whose agents are changed; none: all.
        out: folder of the figure.
    """

    path: Path
    seconds: float
    given: Mapping[str, Any]
    predictor: Path | None
    robots: tuple[str, ...]
    out: Path


@dataclass(frozen=True, slots=True)
class Branch:
    """What would have happened.

    Attributes:
        table: both walks side by side.
        equal: states up to the moment, or to where the walks part, that are equal to the byte.
        parted: the first tick with another state, ms; None if there is none.
        figure: its file.
    """

    table: Table
    equal: int
    parted: int | None
    figure: Path


def answer_what_if(question: WhatIf, console: Console) -> Branch:
    """Walk the branch and hold it against the recorded walk.

    Raises:
        RecordingError: the recording cannot be read or computed again, or another walk comes out
            before the moment.
        ConfigError: an unknown key, a wrong value or robot, or no moment of the walk.
        PredictorError: a predictor is not to be found.
    """
    recording = Recording(question.path)
    config = read_computable_config(recording)
    require_own_agents(recording, config)
    change, changed = _read_change(question, recording, config)
    truths, events = list(recording.messages(Truth)), list(recording.messages(Event))
    last = int(ticks_of(truths).max()) if truths else 0
    if not 0 <= change.moment <= last:
        got, expected = f"{question.seconds:g} s", f"a time up to {1e-3 * last:g} s"
        raise ConfigError("--from", got, expected, "the recorded walk has no more")
    predictor, _ = find_predictor(recording, config, None)
    warm_up(config, console)
    walked, happened, equal, parted = list[Truth](), list[Event](), 0, None
    bar = build_progress(console, "{task.completed:.1f}/{task.total:g} s", fleeting=True)
    with bar:
        task = bar.add_task("walking", total=change.config.world.duration)
        for tick in walk_branch(recording, config, predictor, change):
            walked += [] if tick.truth is None else [tick.truth]
            happened += tick.events
            equal, parted = tick.equal, tick.parted
            if tick.tick % _SHOWN == 0:
                bar.update(task, completed=1e-3 * tick.tick)
    recorded, branch = (
        build_course(config, *course) for course in ((truths, events), (walked, happened))
    )
    table = build_what_if_table(config, recorded, branch, change.moment, changed)
    figure = question.out / f"whatif-{change.moment}.png"
    names = robot_names(config.team.robots)
    draw_branch((recorded, branch), names, change.moment, figure, table.title)
    return Branch(table, equal, parted, figure)


def _read_change(question: WhatIf, recording: Recording, config: Config) -> tuple[Change, str]:
    """What is different, and the same in words."""
    names = robot_names(config.team.robots)
    for robot in question.robots:
        if robot not in names:
            raise ConfigError("--robot", repr(robot), f"one of {', '.join(names)}")
    if not isfinite(question.seconds):
        raise ConfigError("--from", f"{question.seconds}", "a time [s]")
    changed = change_config(config, question.given)
    if changed.team != config.team:
        what = format_changes(config, changed)
        raise ConfigError("team", what, "the recorded team", "the walk up to the moment is its own")
    for one in (config, changed):
        if find_kind(one.planner.kind).central:
            kind, cause = one.planner.kind, "a planner of the whole team is no part of an agent"
            raise ConfigError("planner.kind", repr(kind), "one that each agent runs itself", cause)
    predictor, same = find_predictor(recording, changed, question.predictor)
    if changed == config and same:
        words = "nothing changed"
        predictor = find_predictor(recording, config, None)[0]
    else:
        words = format_changes(config, changed) or f"predictor {question.predictor}"
    if question.robots and words != "nothing changed":
        words += f" (agents of {', '.join(question.robots)})"
    moment = round(1000 * question.seconds)
    return Change(moment, changed, predictor, question.robots or names), words
