"""SHELL of a bridge's milliseconds: receive, let the supervisor decide, send; begin and end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from quadriga.bridges.checks import check_reports, refuse_failed
from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.guard import BEAT_MS, Guard
from quadriga.bridges.modes import BridgeMode, Wish
from quadriga.bridges.supervisor import Supervised, Supervisor, SupervisorInputs, SupervisorState
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.runtime.histogram import Histogram
from quadriga.shared.unitree.packets import RobotReport
from quadriga.shared.wire.messages import Command, Status

TICK: Final = 1e-3  # s
SLACK_MS: Final = 3000  # beyond what a motion takes
_LOOK_MS: Final = 1000  # of reports that are checked before the robot is commanded
_FIND_MS: Final = 3000  # for the first of them to come
_INTRODUCE_MS: Final = 500  # between two packets to a robot that is silent
_ANSWER_BIN: Final = 0.05  # ms
_WARN_MS: Final = 1000, 60_000  # from a look for what to warn of to the next, and from a warning
_LEAVE_MS: Final = 100  # of packets at the end, that one of them arrives


class Answer(NamedTuple):
    """An agent's command.

    Attributes:
        command: the newest.
        age: of the state that it answers, ms.
        arrived: when the report of that state came, s; None: it has been sent before.
    """

    command: Command
    age: int
    arrived: float | None = None


class RobotLoop:
    """One robot, and who decides what it does. No motor is enabled before `take_charge`.

    Args:
        config: the team's configuration.
        name: of the robot.
        driver: the way to it.
        guard: brings the robot to rest when this process dies or hangs; None: a dry run, in which
            no motor is ever enabled.
        say: tells the operator what happens.
        clock: one that never goes back, s.

    Attributes:
        memory: what the supervisor remembers.
        now: ms since this was made.
        report: the newest; None before the first.
        report_at: when it came, ms.
        arrived: the same by `clock`, s.
        estops: tells why the team's emergency stop was pressed; "" if it was not.
        untold: changes that nobody has taken yet: when, ms, the mode and its reason.
        foot_refresh: how often feet's counts changed in the second in which they did most, Hz.
        answers: times from a report's arrival to the command that was made of it, ms.

    Raises:
        ConfigError: `bridge.stop_buttons` names no buttons.
    """

    def __init__(
        self,
        config: Config,
        name: str,
        driver: RobotDriver,
        *,
        guard: Guard | None,
        say: Callable[[str], None],
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self._config, self._name = config, name
        self._driver, self._guard, self._say = driver, guard, say
        self._clock, self._turned_at = clock, clock()
        self._supervisor = Supervisor(config.robot, config.bridge, driver.servo)
        self.memory: SupervisorState = self._supervisor.initial(0, armed=guard is not None)
        self.now = 0
        self.report: RobotReport | None = None
        self.report_at, self.arrived = -1, 0.0
        self._sent_at, self._warn_at = 0, 0
        self.foot_refresh = self._foot_changes = 0
        self._foot_second = clock()
        self.estops: Callable[[], str] = str
        self.untold = list[tuple[int, BridgeMode, str]]()
        self.answers = Histogram(_ANSWER_BIN)
        self._in_charge = False  # of the robot's motors
        self._guard_gone = False
        self._cut: Counter[str] = Counter()

    @property
    def mode(self) -> BridgeMode:
        """What the supervisor lets the robot do now."""
        return self.memory.mode

    @property
    def left_ms(self) -> int:
        """How long the motion that is made now may take, ms."""
        motion = self.memory.motion
        seconds = self._config.bridge.stand_s if motion is None else motion.seconds
        return round(1000.0 * seconds) + SLACK_MS

    def look(self, stopped: Callable[[], bool], *, hung: bool = False, tells: bool = True) -> bool:
        """Check a second of reports; False if `stopped()` came first.

        Args:
            stopped: asked often whether to stop.
            hung: whether the robot hangs, and does not lie.
            tells: whether the operator is told what was found.

        Raises:
            CheckError: the robot is not as it must be.
        """
        driver, rate, reports = self._driver, Rate(TICK), list[RobotReport]()
        malformed = driver.counters["malformed"]
        for ms in range(_FIND_MS):
            if stopped():
                return False
            self._begin_turn()
            if self.receive():
                break
            if ms % _INTRODUCE_MS == 0:
                driver.introduce()
            rate.wait()
        while self.receive():  # what came before this second
            pass
        before = driver.counters["received"]
        for _ in range(_LOOK_MS):
            if stopped():
                return False
            self._begin_turn()
            if self.receive():
                reports += [] if self.report is None else [self.report]
            rate.wait()
        malformed = driver.counters["malformed"] - malformed
        findings = check_reports(
            reports,
            _LOOK_MS / 1000,
            driver.packets_ms,
            self._config.bridge,
            self._config.robot,
            received=driver.counters["received"] - before,
            hung=hung,
            cause=f"{malformed} malformed, the last one {driver.malformed}" if malformed else "",
        )
        for finding in findings if tells else ():
            self._say(f"{finding.name}: {finding.got}{'' if finding.ok else '  <- not right'}")
        refuse_failed(self._name, findings)
        return True

    def take_charge(self) -> None:
        """Have the robot's own controller let go of the motors, and answer for them.

        Raises:
            BridgeError: it does not let go.
        """
        try:
            self._driver.take_over()
        finally:
            if released := self._driver.released:
                self._say(
                    f"{self._name}: its own controller {released!r} was asked to let go of the "
                    f"motors; --restore {released} gives them back"
                )
        self._in_charge = True
        self._stall()

    def turn(self, answer: Answer | None, wish: Wish) -> Supervised | None:
        """A millisecond: receive, decide, send.

        An agent's new command is sent at once, and some command once in a period at least. In the
        milliseconds between two commands there is nothing to decide.

        Args:
            answer: the agent's newest command; None before the first, and before the walk.
            wish: what the robot is to do.

        Returns:
            What was decided; None between two commands, and before the first report.
        """
        self._begin_turn()
        period, is_new = self._driver.period_ms, answer is not None and answer.arrived is not None
        is_due = is_new or self.now - self._sent_at >= period
        if not is_due:
            return None
        if self.now - self.report_at >= period:
            self.receive()
        report = self.report
        if report is None:
            return None
        inputs = SupervisorInputs(
            now=self.now,
            report=report,
            report_age=self.now - self.report_at,
            command=None if answer is None else answer.command,
            command_age=0 if answer is None else answer.age,
            wish=wish,
            writers=self._driver.other_writers(),
            stall=self._stall(),
            guarded=not self._guard_gone,
            estop=self.estops(),
        )
        self.memory, supervised = self._supervisor.step(self.memory, inputs)
        self._cut.update(supervised.cut)
        self._sent_at = self.now
        if supervised.targets is not None:
            self._driver.send(supervised.targets)
            if answer is not None and answer.arrived is not None:
                self.answers.add(1e3 * (self._clock() - answer.arrived))
        changes = [*supervised.changes]
        if self.now >= self._warn_at and self.mode is not BridgeMode.STOPPED:
            warning = self._supervisor.warning(report)
            self._warn_at = self.now + _WARN_MS[bool(warning)]
            changes += [(self.mode, warning)] if warning else []
        for mode, reason in changes:
            self._say(f"{self._name}: {mode} {reason}".rstrip())
            self.untold.append((self.now, mode, reason))
        return supervised

    def leave(self) -> None:
        """Have the robot lie down, switch its motors off, and leave."""
        if self._in_charge:
            self._come_to_rest()
        if self._guard is not None:
            self._guard.dismiss()
        self._driver.close()

    def _come_to_rest(self) -> None:
        resting = (BridgeMode.DRY, BridgeMode.LIMP, BridgeMode.STOPPED)
        rate, before, left = Rate(TICK), self.mode, self.left_ms
        while self.mode not in resting and left > 0:
            self.turn(None, Wish.LIE)
            rate.wait()
            if self.mode is not before:
                before, left = self.mode, self.left_ms
            left -= 1
        passive = round(1000 * self._config.bridge.passive_s)
        for _ in range(_LEAVE_MS + (passive if self.mode is BridgeMode.STOPPED else 0)):
            self.turn(None, Wish.REST)
            rate.wait()

    def describe(self, status: Status) -> Status:
        """With the bridge's mode and reason, and counters of the robot and of its packets.

        `<robot>.answer` of `ages_ms` is the time from the arrival of a report to the command that
        the agent made of it.
        """
        ages = {**status.ages_ms, **self.answers.quantiles(f"{self._name}.answer")}
        counters = {**status.counters, **self._driver.counters}
        counters |= {f"limited_{name}": count for name, count in self._cut.items()}
        report = self.report
        if report is not None:
            counters["foot_refresh_hz"] = self.foot_refresh
            counters["hottest_c"] = int(np.max(report.temperature))
            counters["motors_lost"] = int(np.sum(report.lost))
            if report.battery is not None:
                counters["battery_percent"] = report.battery.charge
        mode, reason = str(self.mode), self.memory.reason
        return replace(status, mode=mode, reason=reason, ages_ms=ages, counters=counters)

    def _begin_turn(self) -> None:
        """Count a millisecond, and tell the guard that there is one."""
        self.now += 1
        if self._in_charge and self._guard is not None and self.now % BEAT_MS == 0:
            self._guard_gone = not self._guard.beat()

    def receive(self) -> bool:
        """Take the newest report; whether one has come."""
        report = self._driver.receive()
        if report is None:
            return False
        self._count_foot_changes(report)
        self.report, self.report_at, self.arrived = report, self.now, self._clock()
        return True

    def _count_foot_changes(self, report: RobotReport) -> None:
        now = self._clock()
        if now - self._foot_second >= 1.0:
            rate = round(self._foot_changes / (now - self._foot_second))
            self.foot_refresh = max(self.foot_refresh, rate)
            self._foot_second, self._foot_changes = now, 0
        before = report if self.report is None else self.report
        self._foot_changes += not np.array_equal(report.foot, before.foot)

    def _stall(self) -> int:
        """Milliseconds since this was asked last: more than one if the process stood still."""
        before, self._turned_at = self._turned_at, self._clock()
        return round(1000.0 * (self._turned_at - before))
