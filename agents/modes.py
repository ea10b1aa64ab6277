"""When an agent's robot walks, stops, and walks again: the agent's part of `shared.modes`.

A robot that stands for a loss, or because somebody has asked for it, walks again at the begin of a
half cycle, once all its inputs have been there for `team.resume_after`, if the operator has asked
for it lately; after a loss also by itself, if the team is configured so. Then it follows the
commanded speed in a ramp. A fault or an emergency stop lasts until the operator's reset.

A robot does not walk while another one of its team does not: it would drag it along. In real time
each robot hears every other's status ten times a second, and at once when its mode changes. In
lock-step it does not: what it knew would depend on who was faster.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

from quadriga.agents.step_io import Inputs
from quadriga.shared.codes import (
    HALTS,
    INPUT_LOST,
    RESUMED,
    STANDS_AGAIN,
    STANDS_UP,
    code_of,
    with_detail,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event, Reference, Status
from quadriga.shared.modes import (
    COMMANDED,
    ESTOP,
    LOSSES,
    PEER_LOST,
    REFERENCE_LOST,
    STAND,
    STANDING_UP,
    STOPPED,
    STOPPING,
    WALK,
    Mode,
    Stop,
    next_mode,
)
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import REFERENCE

REQUEST_MS: Final = 5000  # for which the operator's request to go on is obeyed
RAMP_MS: Final = 1000  # from standing to the commanded speed
SILENCE_MS: Final = 500  # without a status, after which a robot is lost
GRACE_MS: Final = 1000  # for which robots that walk again may begin one after the other
_LOOKED_BACK_MS: Final = 4000  # at most, from a tick to the oldest reference that still matters


@record
class ResumeState:
    """What an agent remembers of its way back to walking, in ticks; −1: never.

    Attributes:
        inputs_ok_since: from when on it counts that all inputs are there.
        requested: when the operator's request to go on came that is in force.
        resumed: when the robot last began to walk again.
        stopped: when somebody last asked the team to stop.
    """

    inputs_ok_since: int = -1
    requested: int = -1
    resumed: int = -1
    stopped: int = -1


Statuses = Mapping[str, Status]  # the newest of each other robot that has spoken


class ModeRules:
    """Fixed data of when one robot changes its mode; what it gives depends on arguments alone."""

    def __init__(self, config: Config, robot: str) -> None:
        self._peers = tuple(n for n in robot_names(config.team.robots) if n != robot)
        self._hears_peers = config.world.mode == "realtime"
        self._stand_ms, self._stance_ms = config.gait.stand_ms, config.gait.stance_ms
        self._resumes_alone = config.team.auto_resume
        self._resume_ms = round(1000 * config.team.resume_after)

    def course(
        self, mode: Mode, resume: ResumeState, last: int, tick: int
    ) -> tuple[Mode, ResumeState]:
        """The mode if nothing stops the robot between the ticks `last` and `tick`."""
        if mode.name == WALK:
            return mode, resume
        before, now = ((t - self._stand_ms) // self._stance_ms for t in (last, tick))
        stance_ends = before != now
        if stance_ends and self._can_resume(mode, resume, tick):
            return Mode(WALK, tick), replace(resume, resumed=tick)
        return next_mode(mode, tick, self._stand_ms, stance_ends), resume

    def _can_resume(self, mode: Mode, resume: ResumeState, tick: int) -> bool:
        if mode.name != STAND or not mode.may_resume or resume.inputs_ok_since < 0:
            return False
        requested = resume.requested >= 0 and tick - resume.requested <= REQUEST_MS
        alone = self._resumes_alone and code_of(mode.reason) in LOSSES
        return (alone or requested) and tick - resume.inputs_ok_since >= self._resume_ms

    def stops(
        self, mode: Mode, inputs: Inputs, statuses: Statuses, reference_age: int
    ) -> list[Stop]:
        """What asks a robot to stop, of all that arrived, or did not.

        `reference_age` is that of the operator's reference in force, ms.
        """
        stops = requested_stops(inputs)
        if mode.name != WALK:
            return stops
        if reference_age > REFERENCE.max_age_ms:
            stops.append(Stop(STOPPING, REFERENCE_LOST))
        tick = inputs.state.tick
        lost = [name for name, s in statuses.items() if _has_stopped(s, tick, mode.since)]
        if lost:
            stops.append(Stop(STOPPING, with_detail(PEER_LOST, ",".join(sorted(lost)))))
        return stops

    def peers_ready(self, statuses: Statuses, tick: int) -> bool:
        """Whether all others stand and may walk again, or walk already."""
        return not self._hears_peers or all(
            name in statuses and _can_walk(statuses[name], tick) for name in self._peers
        )

    def peers_rest(self, statuses: Statuses, tick: int, since: int) -> bool:
        """Whether no other robot walks, as far as is known; after a while nobody is waited for.

        They could be heard from the tick `since` on.
        """
        recent = [s for s in statuses.values() if tick - s.tick <= SILENCE_MS and s.tick > since]
        if any(status.mode in (WALK, STOPPING) for status in recent):
            return False
        return len(recent) == len(self._peers) or tick - since > GRACE_MS

    def remember(
        self, resume: ResumeState, mode: Mode, inputs: Inputs, *, inputs_ok: bool
    ) -> ResumeState:
        """What is remembered after a tick.

        Requests are sent several times, and may come late: one to go on that was made before a
        stop, or at the same tick, counts no more. `mode` is that after the tick, and `inputs_ok`
        whether all inputs of a robot that stands are there. The time is counted from the next half
        cycle, so that robots go on together.
        """
        tick, stopped = inputs.state.tick, resume.stopped
        # Who did not know the time wrote 0; nobody can know one that is still to come.
        if inputs.stop is not None:
            stopped = max(stopped, min(inputs.stop.tick or tick, tick))
        if not mode.may_resume:
            return ResumeState(resumed=resume.resumed, stopped=stopped)
        since = -1
        if inputs_ok:
            next_half_cycle = tick + self._stance_ms - (tick - self._stand_ms) % self._stance_ms
            since = resume.inputs_ok_since if resume.inputs_ok_since >= 0 else next_half_cycle
        requested = -1 if inputs.stop is not None else resume.requested
        if inputs.resume is not None and inputs.resume.tick > stopped:
            requested = tick
        return ResumeState(since, requested, resume.resumed, stopped)


def requested_stops(inputs: Inputs) -> list[Stop]:
    """The stops that people have asked for."""
    stops: list[Stop] = []
    if inputs.estop is not None:
        stops.append(Stop(ESTOP, with_detail(ESTOP, inputs.estop.reason)))
    if inputs.stop is not None:
        stops.append(Stop(STOPPING, with_detail(STOPPED, inputs.stop.reason)))
    return stops


def newest_statuses(known: Statuses, arrived: Iterable[tuple[str, Status]]) -> Statuses:
    """The newest status of each robot; of several that arrived at once the last counts."""
    newest = dict(arrived)
    return {**known, **newest} if newest else known


def ramp(
    references: tuple[Reference, ...], resume: ResumeState, tick: int
) -> tuple[Reference, ...]:
    """The operator's references as a robot follows them that has begun to walk again.

    Nothing is asked of it for the time before, and then a rising share of the speed.
    """
    begun = resume.resumed
    if begun < 0 or tick - begun > RAMP_MS + _LOOKED_BACK_MS:
        return references
    return tuple(slowed(item, min(1.0, max(0, item.tick - begun) / RAMP_MS)) for item in references)


def slowed(reference: Reference, share: float) -> Reference:
    """A reference with a share of its speed."""
    if share == 1.0:
        return reference
    vx, vy, wz = share * reference.vx, share * reference.vy, share * reference.wz
    return replace(reference, vx=vx, vy=vy, wz=wz)


def change_event(before: Mode, after: Mode, tick: int, robot: str) -> Event | None:
    """What an agent announces of a change of its mode: why it stops, and its way back."""
    if after.name == STANDING_UP and before.name != STANDING_UP:
        return Event.of(tick, STANDS_UP, robot, f"stands up where it is: {after.reason}")
    if before.name == STANDING_UP and after.name == STAND:
        return Event.of(tick, STANDS_AGAIN, robot, f"stands after {tick - before.since} ms")
    if after.may_resume and not before.reason:
        code = HALTS if code_of(after.reason) in COMMANDED else INPUT_LOST
        return Event.of(tick, code, robot, f"slows down and stands: {after.reason}")
    if after.name == WALK and before.may_resume:
        return Event.of(tick, RESUMED, robot, f"walks again after {before.reason}")
    return None


def _has_stopped(status: Status, tick: int, since: int) -> bool:
    """Whether another robot is silent or does not walk, to one that walks since a tick."""
    if tick - status.tick > SILENCE_MS:
        return True
    if status.mode in (STAND, STOPPING):
        return bool(status.reason) and status.tick > since + GRACE_MS
    return status.mode != WALK


def _can_walk(status: Status, tick: int) -> bool:
    if tick - status.tick > SILENCE_MS:
        return False
    if status.mode == STAND:
        return not status.reason or Mode(STAND, status.tick, status.reason).may_resume
    return status.mode == WALK
