"""Run one recorded agent again from what it took in, as it was or with something changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.identification.central_planner import collected_of
from quadriga.replay.agent_log import read_agent_log
from quadriga.replay.breakpoint import Breakpoint
from quadriga.replay.comparison import Comparison, ReplayedStep, ReplayVerdict
from quadriga.replay.config_changes import change_config, check_agents, format_changes
from quadriga.replay.figure import Curves, draw
from quadriga.replay.outcome import ReplayOutcome, format_inputs
from quadriga.replay.problem_saver import ProblemSaver
from quadriga.replay.recorded_inputs import RecordedInputs
from quadriga.replay.recorded_predictor import find_predictor
from quadriga.replay.saved_qp import PLANNER, WHOLE_BODY, problems_of, save
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.scheduling import collector_off
from quadriga.shared.topics import PLAN

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
    *,
    handed_over: bool = True,
) -> ReplayOutcome:
    """Replay one robot; in the middle a second agent goes on with the first's memory.

    Of a planner that keeps state elsewhere the rest is then not equal any more.

    Args:
        job: whose replay, and how.
        show: called with what is being done.
        stop_at: where to stop in the debugger, or what saves the QPs of a moment.
        handed_over: whether a second agent goes on in the middle, if nothing is changed.

    Raises:
        QuadrigaError: as `quadriga.replay.team_replay.replay`.
    """
    begun = monotonic()
    use_one_blas_thread()
    recording = Recording(job.path)
    config = recorded_config(recording)
    recorded, current, changed = _build_agents(job, recording, config)
    handed_over = handed_over and not changed and stop_at is None
    second = _build_agents(job, recording, config)[0] if handed_over else current
    inbox = Inbox(config, job.robot, recorded.peers)
    log = read_agent_log(recording, config, recorded, inbox, lambda tick: show("reading", tick))
    curves = Curves(config.planner.applied) if changed else None
    comparison = Comparison(log, None if curves is None else curves.add)
    middle = (min(log.states, default=-1) + log.last) // 2
    inputs = RecordedInputs(config, recorded, Inbox(config, job.robot, recorded.peers), log)
    with collector_off():  # a long log need not be looked through again and again
        agents = current, second
        _replay_steps(agents, middle, inputs, comparison, show, stop_at, changed=bool(changed))
        comparison.pass_untold(log)
    verdict = comparison.finish()
    wall = monotonic() - begun
    drawn = () if curves is None else (_draw_curves(job, curves, changed),)
    saved = () if stop_at is None else _files_of(stop_at, job.robot, log.last)
    outcome = ReplayOutcome(
        job.robot,
        verdict,
        changed,
        seconds=(verdict.last + 1) / 1000,
        wall=wall,
        inputs="" if verdict.step is None else format_inputs(verdict.step),
        files=(*(drawn or _save_problem(job, current, verdict)), *saved),
        stateful=handed_over and _is_stateful(job, verdict, middle),
    )
    verdict.step = None  # not to be carried between processes
    return outcome


def _is_stateful(job: ReplayJob, verdict: ReplayVerdict, middle: int) -> bool:
    """Whether the first difference is there only because another agent went on in the middle."""
    first = verdict.first
    if first is None or first.tick < middle:
        return False
    again = replay_agent(job, handed_over=False).verdict
    return again.first is None or again.first.tick > first.tick


def _files_of(stop_at: Breakpoint | ProblemSaver, robot: str, last: int) -> tuple[Path, ...]:
    """What was saved at a moment, if the robot has lived to see it; `last` is its last tick.

    Raises:
        ConfigError: it is after that.
    """
    if not stop_at.reached:
        got, expected = f"{stop_at.tick / 1000:g} s", f"a time up to {last / 1000:g} s"
        raise ConfigError(stop_at.option, got, expected, f"{robot} has no step after it")
    return stop_at.files


def _build_agents(job: ReplayJob, recording: Recording, config: Config) -> tuple[Agent, Agent, str]:
    """The agent as it was recorded, as it is now, and what was changed, as text."""
    predictor, same = find_predictor(recording, config, job.predictor)
    recorded = Agent(config, job.robot, predictor, collected=collected_of(config))
    new = change_config(config, job.given)
    changed = format_changes(config, new) + ("" if same else f" predictor {job.predictor}")
    current = recorded
    if changed:
        current = Agent(new, job.robot, predictor, collected=collected_of(new))
    check_agents(recorded, current)
    return recorded, current, changed.strip()


def _replay_steps(
    agents: tuple[Agent, Agent],
    middle: int,
    inputs: RecordedInputs,
    comparison: Comparison,
    show: Show,
    stop_at: Breakpoint | ProblemSaver | None,
    *,
    changed: bool,
) -> None:
    """Step one life of the agent over all it took in; up to what is missing unless it is changed.

    Its begin is as that of an agent that has just been started; the second goes on at the middle.
    """
    memory = agents[0].initial()
    for step in inputs.steps():
        comparison.verdict.missing += [(step.tick, name) for name in step.missing]
        if step.missing and not changed:
            return
        if step.inputs is None:
            continue
        agent = agents[step.tick >= middle]
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
