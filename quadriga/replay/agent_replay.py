"""Run one recorded agent again from what it took in, as it was or with something changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.agents.agent import Agent
from quadriga.agents.inbox.inbox import Inbox
from quadriga.replay.agent_log import read_agent_log
from quadriga.replay.breakpoint import Breakpoint
from quadriga.replay.comparison import Comparison, ReplayedStep, ReplayVerdict
from quadriga.replay.config_changes import change_config, check_agents, format_changes
from quadriga.replay.figure import Curves, draw
from quadriga.replay.lives import first_tick, split_lives
from quadriga.replay.outcome import ReplayOutcome, format_inputs
from quadriga.replay.problem_saver import ProblemSaver
from quadriga.replay.recorded_inputs import RecordedInputs
from quadriga.replay.recorded_predictor import find_predictor
from quadriga.replay.saved_qp import PLANNER, WHOLE_BODY, problems_of, save
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.blas import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.collector import collector_off
from quadriga.shared.wire.topics import PLAN

_SHOWN_EVERY: Final = 100  # ticks

Show = Callable[[str, int], None]
"""Called with what is being done and up to which tick it has come."""


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


def replay_agent(
    job: ReplayJob,
    show: Show = lambda doing, tick: None,
    stop_at: Breakpoint | ProblemSaver | None = None,
) -> ReplayOutcome:
    """Replay one robot.

    Args:
        job: whose replay, and how.
        show: called with what is being done.
        stop_at: where to stop in the debugger, or what saves the QPs of a moment.

    Raises:
        QuadrigaError: as `quadriga.replay.team_replay.replay`.
    """
    begun = monotonic()
    use_one_blas_thread()
    recording = Recording(job.path)
    config = recorded_config(recording)
    recorded, current, changed = _build_agents(job, recording, config)
    inbox = Inbox(config, job.robot, recorded.peers)
    log = read_agent_log(recording, config, recorded, inbox, lambda tick: show("reading", tick))
    curves = Curves(config.planner.applied) if changed else None
    comparison = Comparison(log, None if curves is None else curves.add)
    paced = config.world.mode == "realtime"
    lives = split_lives(log, paced=paced, whole=recording.complete)
    begins = tuple(map(first_tick, lives))  # now: what is replayed is taken out of the logs
    with collector_off():  # a long log need not be looked through again and again
        for life in lives:
            inbox = Inbox(config, job.robot, recorded.peers)
            inputs = RecordedInputs(config, recorded, inbox, life)
            _replay_steps(current, inputs, comparison, show, stop_at, changed=bool(changed))
            if comparison.verdict.missing and not changed:
                break  # nothing after it could be equal but by chance
            comparison.end_life(life)
    verdict = comparison.finish()
    wall = monotonic() - begun
    if stop_at is not None:
        _check_reached(stop_at, job.robot, log.last)
    files: tuple[Path, ...] = ()
    if curves is not None:
        files = (_draw_curves(job, curves, changed),)
    elif verdict.first is not None:
        files = _save_problem(job, current, verdict)
    if stop_at is not None:
        files += stop_at.files
    outcome = ReplayOutcome(
        job.robot,
        verdict,
        changed,
        seconds=(verdict.last + 1) / 1000,
        wall=wall,
        inputs="" if verdict.step is None else format_inputs(verdict.step),
        files=files,
        lives=begins,
    )
    verdict.step = None  # not to be carried between processes
    return outcome


def _check_reached(stop_at: Breakpoint | ProblemSaver, robot: str, last: int) -> None:
    """Refuse a moment that the robot has not lived to see; `last` is its last tick.

    Raises:
        ConfigError: it is after that.
    """
    if not stop_at.reached:
        got, expected = f"{stop_at.tick / 1000:g} s", f"a time up to {last / 1000:g} s"
        raise ConfigError(stop_at.option, got, expected, f"{robot} has no step after it")


def _build_agents(job: ReplayJob, recording: Recording, config: Config) -> tuple[Agent, Agent, str]:
    """The agent as it was recorded, as it is now, and what was changed, as text."""
    predictor, same = find_predictor(recording, config, job.predictor)
    recorded = Agent(config, job.robot, predictor)
    new = change_config(config, job.given)
    changed = format_changes(config, new) + ("" if same else f" predictor {job.predictor}")
    current = Agent(new, job.robot, predictor) if changed else recorded
    check_agents(recorded, current)
    return recorded, current, changed.strip()


def _replay_steps(
    agent: Agent,
    inputs: RecordedInputs,
    comparison: Comparison,
    show: Show,
    stop_at: Breakpoint | ProblemSaver | None,
    *,
    changed: bool,
) -> None:
    """Step one life of the agent over all it took in; up to what is missing unless it is changed.

    Its begin is as that of an agent that has just been started.
    """
    memory = agent.initial()
    for step in inputs.steps():
        comparison.verdict.missing += [(step.tick, name) for name in step.missing]
        if step.missing and not changed:
            return
        if step.inputs is None:
            continue
        if step.tick % _SHOWN_EVERY == 0:
            show(f"replaying {agent.robot}", step.tick)
        if stop_at is not None:
            stop_at.before_step(agent, memory, step.inputs, comparison)
        before = memory
        memory, outputs = agent.step(memory, step.inputs)
        comparison.add(ReplayedStep(before, step.inputs, outputs), told=step.told)


def _draw_curves(job: ReplayJob, curves: Curves, changed: str) -> Path:
    """The figure of what a change makes of the recorded values."""
    path = job.out / f"replay-{job.robot}.png"
    draw(curves, f"{job.robot} of {job.path.parent.name}/{job.path.name}: {changed}", path)
    return path


def _save_problem(job: ReplayJob, agent: Agent, verdict: ReplayVerdict) -> tuple[Path, ...]:
    """The problem behind the first difference, if one was solved."""
    if verdict.first is None or verdict.step is None:
        return ()
    about = f"{job.robot} at tick {verdict.first.tick}"
    problems = problems_of(agent, verdict.step.before, verdict.step.inputs, about)
    kind = PLANNER if verdict.first.name == PLAN.name else WHOLE_BODY
    if kind not in problems:
        return ()
    path = job.out / f"replay-{job.robot}-{verdict.first.tick}-{kind}.npz"
    save(path, problems[kind])
    return (path,)
