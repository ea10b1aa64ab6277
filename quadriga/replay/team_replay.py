"""Run recorded agents again, several side by side, and hold every message against the record."""

from __future__ import annotations

import bdb
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from math import isfinite
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.progress import build_progress
from quadriga.replay.agent_replay import ReplayJob, replay_agent
from quadriga.replay.breakpoint import Breakpoint
from quadriga.replay.outcome import ReplayOutcome
from quadriga.replay.own_agents import require_own_agents
from quadriga.replay.problem_saver import ProblemSaver
from quadriga.shared.errors import ConfigError, QuadrigaError, RecordingError, name_file_errors
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.warm_up import warm_up
from quadriga.workers import run_each

_JOBS: Final = 2  # robots side by side
_SMALL: Final = 4_000_000  # bytes, some seconds: replayed before other processes have started

_Results = Generator[tuple[ReplayJob, ReplayOutcome | QuadrigaError], None, None]


def replay(
    path: Path,
    robots: tuple[str, ...],
    given: Mapping[str, Any],
    predictor: Path | None,
    out: Path | None,
    console: Console,
) -> list[ReplayOutcome]:
    """Replay robots of a recording; their outcomes in the team's order.

    Args:
        path: the recording.
        robots: their names; none: the whole team.
        given: configuration keys to change, by section and key.
        predictor: instead of the one the team walked with.
        out: folder for what is left behind; by default that of the recording.
        console: where to show progress.

    Raises:
        RecordingError: the recording cannot be read, or lacks what a replay needs; or the agents
            were a controller of a user's own.
        ConfigError: no such robot, or a change that cannot be replayed.
        PredictorError: the predictor is not to be found.
    """
    recording = Recording(path)
    config = recorded_config(recording)
    require_own_agents(recording, config)
    jobs = [
        ReplayJob(path, robot, given, predictor, _make_folder(path, out))
        for robot in _choose_robots(robots, robot_names(config.team.robots))
    ]
    warm_up(config, console)
    return [_replay_alone(jobs[0], console)] if len(jobs) == 1 else _replay_all(jobs, console)


def _replay_alone(job: ReplayJob, console: Console) -> ReplayOutcome:
    with build_progress(console, elapsed=True, fleeting=True) as progress:
        task = progress.add_task("", total=None)

        def show(doing: str, tick: int) -> None:
            progress.update(task, description=f"{doing} {tick / 1000:.1f} s")

        return replay_agent(job, show)


def _replay_all(jobs: Sequence[ReplayJob], console: Console) -> list[ReplayOutcome]:
    """Replay robots; the first error that one of them met is raised at the end."""
    outcomes: dict[str, ReplayOutcome] = {}
    errors: list[QuadrigaError] = []
    bar = build_progress(console, elapsed=True, fleeting=True)
    with closing(_replay_each(jobs)) as results, bar as progress:
        for job, result in progress.track(results, len(jobs), description="replaying the team"):
            if isinstance(result, QuadrigaError):
                errors.append(result)
            else:
                outcomes[job.robot] = result
    if errors:
        raise errors[0]
    return [outcomes[job.robot] for job in jobs]


def _replay_each(jobs: Sequence[ReplayJob]) -> _Results:
    """Jobs with what came of them: of a small recording one after the other, else side by side."""
    if jobs[0].path.stat().st_size <= _SMALL:
        return ((job, _try_replay(job)) for job in jobs)
    return run_each(_try_replay, jobs, _JOBS)


def replay_to_breakpoint(
    path: Path,
    robot: str,
    given: Mapping[str, Any],
    predictor: Path | None,
    out: Path | None,
    seconds: float,
    *,
    save_qp: bool = False,
) -> ReplayOutcome:
    """Replay one robot with a stop in the debugger before the step at a time, s.

    With `save_qp` it saves the QPs of that step instead.

    Raises:
        ConfigError: that is no time.
        QuadrigaError: as `replay`.
        KeyboardInterrupt: the user has left the debugger.
    """
    if not isfinite(seconds):
        option = ProblemSaver.option if save_qp else Breakpoint.option
        raise ConfigError(option, f"{seconds}", "a time [s]")
    recording = Recording(path)
    config = recorded_config(recording)
    require_own_agents(recording, config)
    _choose_robots((robot,), robot_names(config.team.robots))
    job = ReplayJob(path, robot, given, predictor, _make_folder(path, out))
    try:
        tick = round(1000 * seconds)
        stop_at = ProblemSaver(tick, job.out) if save_qp else Breakpoint(tick)
        return replay_agent(job, stop_at=stop_at)
    except bdb.BdbQuit:
        raise KeyboardInterrupt from None


def _try_replay(job: ReplayJob) -> ReplayOutcome | QuadrigaError:
    try:
        return replay_agent(job)
    except QuadrigaError as error:
        return error


def _choose_robots(robots: tuple[str, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """The robots asked for, or all of a team with these names."""
    for robot in robots:
        if robot not in names:
            raise ConfigError("--robot", repr(robot), f"one of {', '.join(names)}")
    return robots or names


def _make_folder(path: Path, out: Path | None) -> Path:
    folder = out or path.parent
    with name_file_errors(RecordingError, f"--out {folder}", "a folder that can be made"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder
