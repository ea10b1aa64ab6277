"""Run recorded agents again from what they took in, and hold every message against the record."""

from __future__ import annotations

import bdb
import gc
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.agents.inbox.inbox import Inbox
from quadriga.replay.agent_log import read_tape
from quadriga.replay.breakpoint import stop_here
from quadriga.replay.changed import changed_config, changes, check_change
from quadriga.replay.figure import Curves, draw
from quadriga.replay.intake import Feed
from quadriga.replay.recorded_predictor import recorded_predictor
from quadriga.replay.rerun import Comparison, ReplayVerdict, rerun
from quadriga.replay.saved_qp import PLANNER, WHOLE_BODY, captured, save
from quadriga.replay.text import in_short
from quadriga.shared.errors import ConfigError, QuadrigaError, RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.runtime.blas import one_blas_thread
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.wire.messages import Message
from quadriga.shared.wire.topics import PLAN
from quadriga.warm_up import warm_up
from quadriga.workers import each_done

_JOBS: Final = 2  # robots side by side
_SHOWN_EVERY: Final = 100  # ticks

Show = Callable[[str, int], None]  # what is being done, up to which tick
Look = Callable[[Agent, AgentState, Inputs, Mapping[str, Message]], None]


@dataclass(frozen=True, slots=True)
class ReplayJob:
    """One robot's replay.

    Attributes:
        path: the recording.
        robot: the robot's name.
        given: configuration keys to change, by section and key.
        predictor: a predictor's file instead of the recorded one's.
        out: folder for what is left behind.
    """

    path: Path
    robot: str
    given: Mapping[str, Any]
    predictor: Path | None
    out: Path


@dataclass(frozen=True, slots=True)
class ReplayOutcome:
    """What came of one robot's replay.

    Attributes:
        robot: its name.
        verdict: what is equal and what is not.
        changed: what was changed, empty for a plain replay.
        seconds: world time replayed, s.
        wall: time that reading and replaying took, s.
        inputs: what the agent took in at the first difference, in short.
        files: what was left behind: the figure of a change, the problem at a difference.
    """

    robot: str
    verdict: ReplayVerdict
    changed: str
    seconds: float
    wall: float
    inputs: str = ""
    files: tuple[Path, ...] = ()

    @property
    def failed(self) -> bool:
        """Whether what should be equal is not."""
        return not self.changed and not self.verdict.exact


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
        RecordingError: the recording cannot be read, or lacks what a replay needs.
        ConfigError: no such robot, or a change that cannot be replayed.
        PredictorError: the predictor is not to be found.
    """
    config = recorded_config(Recording(path))
    jobs = [
        ReplayJob(path, robot, given, predictor, _folder(path, out))
        for robot in _known(robots, robot_names(config.team.robots))
    ]
    warm_up(config, console)
    if len(jobs) == 1:
        with _bar(console) as progress:
            task = progress.add_task("", total=None)

            def show(doing: str, tick: int) -> None:
                progress.update(task, description=f"{doing} {tick / 1000:.1f} s")

            return [replay_one(jobs[0], show)]
    with closing(each_done(_in_worker, jobs, _JOBS)) as done, _bar(console) as progress:
        found = list(progress.track(done, len(jobs), description="replaying the team"))
    for _, outcome in found:
        if isinstance(outcome, QuadrigaError):
            raise outcome
    outcomes = {job.robot: outcome for job, outcome in found if isinstance(outcome, ReplayOutcome)}
    return [outcomes[job.robot] for job in jobs]


def break_in(
    path: Path,
    robot: str,
    given: Mapping[str, Any],
    predictor: Path | None,
    out: Path | None,
    seconds: float,
) -> ReplayOutcome:
    """Replay one robot with a stop in the debugger before the step at a time, s.

    Raises:
        ConfigError: that is no time.
        QuadrigaError: as `replay`.
        KeyboardInterrupt: the user has left the debugger.
    """
    if not isfinite(seconds):
        raise ConfigError("--break", f"{seconds}", "a time [s]")
    _known((robot,), robot_names(recorded_config(Recording(path)).team.robots))
    job = ReplayJob(path, robot, given, predictor, _folder(path, out))
    try:
        return replay_one(job, look=stop_here, at=round(1000 * seconds))
    except bdb.BdbQuit:
        raise KeyboardInterrupt from None


def replay_one(
    job: ReplayJob, show: Show = lambda doing, tick: None, look: Look | None = None, at: int = 0
) -> ReplayOutcome:
    """Replay one robot.

    Args:
        job: whose replay, and how.
        show: told what is being done.
        look: called once, before the first step from tick `at` on: with the agent, its memory,
            what it takes in and what it said then.
        at: see `look`.

    Raises:
        QuadrigaError: as `replay`.
    """
    begun = monotonic()
    one_blas_thread()
    recording = Recording(job.path)
    config = recorded_config(recording)
    predictor, own = recorded_predictor(recording, config, job.predictor)
    recorded_agent = Agent(config, job.robot, predictor)
    new = changed_config(config, job.given)
    changed = changes(config, new) + ("" if own else f" predictor {job.predictor}")
    agent = Agent(new, job.robot, predictor) if changed else recorded_agent
    check_change(recorded_agent, agent)
    arrivals = Inbox(config, job.robot, recorded_agent.peers)
    tape = read_tape(
        recording, config, recorded_agent, arrivals, lambda tick: show("reading", tick)
    )
    curves = Curves(config.planner.applied) if changed else None
    comparison = Comparison(tape, None if curves is None else curves.add)
    verdict = comparison.verdict
    looked = False

    def before_step(memory: AgentState, inputs: Inputs) -> None:
        nonlocal looked
        tick = inputs.state.tick
        if tick % _SHOWN_EVERY == 0:
            show(f"replaying {job.robot}", tick)
        if look is not None and not looked and tick >= at:
            looked = True
            look(agent, memory, inputs, comparison.recorded(tick))

    def missed(tick: int, name: str) -> bool:
        verdict.missing.append((tick, name))
        return not changed  # nothing after it could be equal but by chance

    feed = Feed(config, recorded_agent, arrivals, tape)
    gc.disable()  # a long tape need not be looked through again and again
    try:
        rerun(agent, feed, comparison.note, missed, before_step)
    finally:
        gc.enable()
    comparison.finish()
    wall = monotonic() - begun
    if look is not None and not looked:
        raise ConfigError(
            "--break",
            f"{at / 1000:g} s",
            f"a time up to {tape.last / 1000:g} s",
            f"{job.robot} has no step after it",
        )
    files: tuple[Path, ...] = ()
    if curves is not None:
        title = f"{job.robot} of {job.path.parent.name}/{job.path.name}: {changed.strip()}"
        files = (job.out / f"replay-{job.robot}.png",)
        draw(curves, title, files[0])
    elif verdict.first is not None:
        files = _save_problem(job, agent, verdict)
    outcome = ReplayOutcome(
        job.robot,
        verdict,
        changed.strip(),
        (verdict.last + 1) / 1000,
        wall,
        "" if verdict.step is None else in_short(verdict.step),
        files,
    )
    verdict.step = None  # not to be carried between processes
    return outcome


def _save_problem(job: ReplayJob, agent: Agent, verdict: ReplayVerdict) -> tuple[Path, ...]:
    """The problem behind the first difference, if one was solved."""
    if verdict.first is None or verdict.step is None:
        return ()
    with captured(f"{job.robot} at tick {verdict.first.tick}") as found:
        agent.step(verdict.step.before, verdict.step.inputs)
    kind = PLANNER if verdict.first.name == PLAN.name else WHOLE_BODY
    if kind not in found:
        return ()
    path = job.out / f"replay-{job.robot}-{verdict.first.tick}-{kind}.npz"
    save(path, found[kind])
    return (path,)


def _in_worker(job: ReplayJob) -> ReplayOutcome | QuadrigaError:
    try:
        return replay_one(job)
    except QuadrigaError as error:
        return error


def _known(robots: tuple[str, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    for robot in robots:
        if robot not in names:
            raise ConfigError("--robot", repr(robot), f"one of {', '.join(names)}")
    return robots or names


def _folder(path: Path, out: Path | None) -> Path:
    folder = out or path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RecordingError(f"--out {folder}", reason, "a folder that can be made") from None
    return folder


def _bar(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
