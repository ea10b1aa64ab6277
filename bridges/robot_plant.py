"""The plant of one real robot: its driver, its supervisor, and the team's milliseconds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.bridges.checks import check_reports, refuse_failed
from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.guard import BEAT_MS, Guard
from quadriga.bridges.supervisor import (
    BridgeMode,
    Supervised,
    Supervisor,
    SupervisorInputs,
    SupervisorState,
    Wish,
)
from quadriga.plant.protocol import Plant
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.runtime.histogram import Histogram
from quadriga.shared.unitree.packets import RobotReport
from quadriga.shared.wire import codes
from quadriga.shared.wire.messages import Command, Event, State, Status
from quadriga.shared.wire.topics import SAMPLE_MS

_TICK: Final = 1e-3  # s
_LOOK_MS: Final = 1000  # of reports that are checked before anything is sent
_SAMPLE_AGE: Final = 5  # ms, that a report may be old at a sample of which there is no newer one
_REMEMBERED: Final = 64  # ticks, for which the arrival of their reports is known
_NOTHING: Final = (-1, 0.0)
_ANSWER_BIN: Final = 0.05  # ms
_SLACK_MS: Final = 3000  # beyond what standing up or lying down takes


class RobotPlant(Plant):
    """See `Plant`. Nothing is sent before `prepare`, and never unless it is armed.

    Args:
        config: the team's configuration.
        name: of the robot.
        driver: the way to it.
        guard: brings the robot to rest when this process dies or hangs; None: a dry run, in which
            nothing is ever sent.
        say: tells the operator what happens.
        now: a clock that never goes back, s.

    Raises:
        ConfigError: `bridge.stop_buttons` names no buttons.
    """

    is_robot = True

    def __init__(
        self,
        config: Config,
        name: str,
        driver: RobotDriver,
        *,
        guard: Guard | None,
        say: Callable[[str], None],
        now: Callable[[], float] = monotonic,
    ) -> None:
        self.names, self.tick, self.period_ms = (name,), 0, driver.period_ms
        self._config, self._driver, self._guard, self._say = config, driver, guard, say
        self._clock, self._turned_at = now, now()
        self._idle_rate = Rate(_TICK, now=now, slack=3.0)
        self._supervisor = Supervisor(config.robot, config.bridge, driver.servo)
        self._memory: SupervisorState = self._supervisor.initial(0, armed=guard is not None)
        self._now = 0  # ms since this plant was made; ticks begin with the walk
        self._report: RobotReport | None = None
        self._report_at = -1
        self._published_at = -1
        self._arrived = 0.0  # by the clock
        self._arrivals = [_NOTHING] * _REMEMBERED  # tick of a state, and when its report came
        self._answers = Histogram(_ANSWER_BIN)
        self._yaw: float | None = None
        self._in_charge = False  # of the robot's motors
        self._guard_gone = False
        self._estops: Callable[[], str] = str
        self._cut: Counter[str] = Counter()
        self._untold = list[tuple[int, BridgeMode, str]]()  # changes of before the walk, and when

    @property
    def mode(self) -> BridgeMode:
        """What the supervisor lets the robot do now."""
        return self._memory.mode

    def prepare(self, stopped: Callable[[], bool]) -> bool:
        """Look at the robot's reports, and get it to stand if it may be commanded.

        Raises:
            CheckError: the robot is not as it must be, or it stopped while it stood up.
            BridgeError: its own controller does not let go of the motors.
        """
        name, config = self.names[0], self._config
        if not self._look(stopped):
            return False
        if self._guard is None:
            self._say(f"{name}: dry run, nothing is sent; --armed commands the robot")
            return True
        self._driver.take_over()
        self._in_charge = True
        self._stall()
        rate, left = self._idle_rate, round(1000 * config.bridge.stand_s) + _SLACK_MS
        while self.mode is not BridgeMode.STANDING:
            if stopped():
                return False
            left -= 1
            if self.mode is BridgeMode.STOPPED or left < 0:
                got = self._memory.reason or f"no stand after {config.bridge.stand_s:g} s"
                raise CheckError(f"robot {name}: standing up", got, "a robot that stands")
            self._turn(None, 0, Wish.STAND)
            rate.wait()
        return True

    def _look(self, stopped: Callable[[], bool]) -> bool:
        """A second of reports, checked; False if `stopped()` came first."""
        rate, reports = Rate(_TICK), list[RobotReport]()
        for _ in range(_LOOK_MS):
            if stopped():
                return False
            if self._receive():
                reports += [] if self._report is None else [self._report]
            rate.wait()
        bridge, period = self._config.bridge, self._driver.packets_ms
        findings = check_reports(reports, _LOOK_MS / 1000, period, bridge, self._config.robot)
        for finding in findings:
            self._say(f"{finding.name}: {finding.got}{'' if finding.ok else '  <- not right'}")
        refuse_failed(self.names[0], findings)
        return True

    def listen(self, estops: Callable[[], str]) -> None:
        self._estops = estops

    def states(self) -> Mapping[str, State]:
        """What the robot measures; nothing at ticks at which it has not said anything new.

        States have even ticks at 500 Hz. At each sample there is one, the newest, unless even that
        is old.
        """
        report, tick = self._report, self.tick
        if report is None or tick % self._driver.period_ms:
            return {}
        is_new = self._report_at > self._published_at
        age = self._now - self._report_at
        if not (is_new or (tick % SAMPLE_MS == 0 and age <= _SAMPLE_AGE)):
            return {}
        self._published_at = self._report_at
        self._arrivals[tick % _REMEMBERED] = tick, self._arrived
        if self._yaw is None:
            self._yaw = yaw_of(report.quat_wxyz)
        return {self.names[0]: to_state(report, tick, self._yaw)}

    def step(self, commands: Mapping[str, Command]) -> Sequence[Event]:
        """One millisecond of the walk; its first tells of the time before it, too."""
        command = commands.get(self.names[0])
        age = 0 if command is None else self.tick - command.tick
        told, self._untold = self._untold, []
        begun = [self._event(mode, reason, self._now - at) for at, mode, reason in told]
        changes = self._turn(command, age, Wish.WALK)
        events = begun + [self._event(mode, reason) for mode, reason in changes]
        self._untold = []
        self.tick += 1
        return events

    def idle(self) -> None:
        """A millisecond of standing, while the others are waited for."""
        self._turn(None, 0, Wish.STAND)
        self._idle_rate.wait()

    def finish(self) -> None:
        """Have the robot lie down, switch its motors off, and leave."""
        if self._in_charge:
            self._come_to_rest()
        if self._guard is not None:
            self._guard.dismiss()
        self._driver.close()

    def _come_to_rest(self) -> None:
        rate, left = Rate(_TICK), round(1000 * self._config.bridge.stand_s) + _SLACK_MS
        resting = (BridgeMode.DRY, BridgeMode.LIMP, BridgeMode.STOPPED)
        while self.mode not in resting and left > 0:
            self._turn(None, 0, Wish.LIE)
            rate.wait()
            left -= 1
        if self.mode is BridgeMode.STOPPED:
            for _ in range(round(1000 * self._config.bridge.passive_s) + 100):
                self._turn(None, 0, Wish.REST)
                rate.wait()
        elif self.mode is BridgeMode.LIMP:
            for _ in range(100):  # that one of them arrives
                self._turn(None, 0, Wish.REST)
                rate.wait()

    def describe(self, status: Status) -> Status:
        """With the bridge's mode and reason, and counters of the robot and of its packets.

        `<robot>.answer` of `ages_ms` is the time from the arrival of a report to the command that
        the agent made of it.
        """
        ages = {**status.ages_ms, **self._answers.quantiles(f"{self.names[0]}.answer")}
        counters = {**status.counters, **self._driver.counters}
        counters |= {f"limited_{name}": count for name, count in self._cut.items()}
        report = self._report
        if report is not None:
            counters["hottest_c"] = int(np.max(report.temperature))
            counters["motors_lost"] = int(np.sum(report.lost))
            if report.battery is not None:
                counters["battery_percent"] = report.battery.charge
        mode, reason = str(self.mode), self._memory.reason
        return replace(status, mode=mode, reason=reason, ages_ms=ages, counters=counters)

    def _receive(self) -> bool:
        """Take the newest report; whether there is one. Counts a millisecond."""
        self._now += 1
        if self._in_charge and self._guard is not None and self._now % BEAT_MS == 0:
            self._guard_gone = not self._guard.beat()
        report = self._driver.receive()
        if report is None:
            return False
        self._report, self._report_at, self._arrived = report, self._now, self._clock()
        return True

    def _turn(
        self, command: Command | None, age: int, wish: Wish
    ) -> tuple[tuple[BridgeMode, str], ...]:
        """A millisecond: receive, decide, send. What changed."""
        self._receive()
        report = self._report
        if report is None:
            return ()
        inputs = SupervisorInputs(
            now=self._now,
            report=report,
            report_age=self._now - self._report_at,
            command=command,
            command_age=age,
            wish=wish,
            writers=self._driver.other_writers(),
            stall=self._stall(),
            guarded=not self._guard_gone,
            estop=self._estops(),
        )
        self._memory, supervised = self._supervisor.step(self._memory, inputs)
        self._cut.update(supervised.cut)
        if supervised.targets is not None and self._is_due(supervised):
            self._driver.send(supervised.targets)
            if command is not None and self.mode is BridgeMode.WALKING:
                self._note_answer(command.tick)
        for mode, reason in supervised.changes:
            self._say(f"{self.names[0]}: {mode} {reason}".rstrip())
            self._untold.append((self._now, mode, reason))
        return supervised.changes

    def _note_answer(self, tick: int) -> None:
        """The command of the state of this tick has been sent."""
        if self._arrivals[tick % _REMEMBERED][0] == tick:
            arrived = self._arrivals[tick % _REMEMBERED][1]
            self._answers.add(1e3 * (self._clock() - arrived))
            self._arrivals[tick % _REMEMBERED] = _NOTHING  # sent again, it is no answer

    def _stall(self) -> int:
        """Milliseconds since this was asked last: more than one if the process stood still."""
        before, self._turned_at = self._turned_at, self._clock()
        return round(1000.0 * (self._turned_at - before))

    def _is_due(self, supervised: Supervised) -> bool:
        """In step with the states: the answer to one is sent in its own millisecond."""
        clock = self.tick if self.mode is BridgeMode.WALKING else self._now
        return bool(supervised.changes) or clock % self._driver.period_ms == 0

    def _event(self, mode: BridgeMode, reason: str, ms_ago: int = 0) -> Event:
        text = f"{mode} {reason}".rstrip()
        text += f", {ms_ago / 1000:.1f} s before the walk" if ms_ago else ""
        code = codes.ROBOT_STOPPED if mode is BridgeMode.STOPPED else codes.BRIDGE_MODE
        return Event.of(self.tick, code, self.names[0], text)


def yaw_of(quat_wxyz: Array) -> float:
    """Heading of the trunk, rad."""
    w, x, y, z = quat_wxyz
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def to_state(report: RobotReport, tick: int, yaw: float) -> State:
    """The message of a report at a tick of the team, its heading counted from `yaw`, rad.

    A robot's heading is its own, from where it was switched on. The robots of a team face the same
    way when they start, so that is where all count from.
    """
    w, x, y, z = report.quat_wxyz
    c, s = math.cos(0.5 * yaw), -math.sin(0.5 * yaw)
    turned = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    return State(
        tick,
        tick * 1_000_000,
        report.q,
        report.dq,
        report.tau,
        turned,
        report.gyro,
        report.accel,
        report.foot,
    )
