"""The plant of one real robot: it stands up for the team's milliseconds, and lies down after."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.guard import Guard
from quadriga.bridges.modes import BridgeMode, Wish
from quadriga.bridges.robot_loop import TICK, Answer, RobotLoop
from quadriga.plant.protocol import Plant
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.unitree.packets import RobotReport
from quadriga.shared.wire import codes
from quadriga.shared.wire.messages import Command, Event, State, Status
from quadriga.shared.wire.topics import SAMPLE_MS

_SAMPLE_AGE: Final = 5  # ms, that a report may be old at a sample of which there is no newer one
_REMEMBERED: Final = 64  # ticks, for which the arrival of their reports is known
_NOTHING: Final = (-1, 0.0)


class RobotPlant(Plant):
    """See `Plant`. No motor is enabled before `prepare`, and never unless it is armed.

    Args:
        config: the team's configuration.
        name: of the robot.
        driver: the way to it.
        guard: brings the robot to rest when this process dies or hangs; None: a dry run, in which
            no motor is ever enabled.
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
        self.names, self.tick = (name,), 0  # ticks begin with the walk
        self._config, self.period_ms, self._say = config, driver.period_ms, say
        self._armed = guard is not None
        self._loop = RobotLoop(config, name, driver, guard=guard, say=say, clock=now)
        self._idle_rate = Rate(TICK, now=now, slack=3.0)
        self._published_at = -1
        self._arrivals = [_NOTHING] * _REMEMBERED  # tick of a state, and when its report came
        self._yaw: float | None = None

    @property
    def mode(self) -> BridgeMode:
        """What the supervisor lets the robot do now."""
        return self._loop.mode

    def look(self, stopped: Callable[[], bool]) -> None:
        """Check the robot's reports before the team is there, and tell the operator.

        Raises:
            CheckError: the robot is not as it must be.
        """
        self._loop.look(stopped)

    def prepare(self, stopped: Callable[[], bool]) -> bool:
        """Look at the robot's reports, and get it to stand if it may be commanded.

        Raises:
            CheckError: the robot is not as it must be, or it stopped while it stood up.
            BridgeError: its own controller does not let go of the motors.
        """
        name = self.names[0]
        if not self._loop.look(stopped, tells=False):
            return False
        if not self._armed:
            self._say(f"{name}: dry run, no motor is enabled; --armed commands the robot")
            return True
        self._loop.take_charge()
        return self._stand_up(stopped)

    def _stand_up(self, stopped: Callable[[], bool]) -> bool:
        """Stand up; False if `stopped()` came first.

        Raises:
            CheckError: it stopped, or does not stand when it should.
        """
        loop = self._loop
        before, left = loop.mode, loop.left_ms
        while loop.mode is not BridgeMode.STANDING:
            if stopped():
                return False
            left -= 1
            if loop.mode is BridgeMode.STOPPED or left < 0:
                got = loop.memory.reason or f"{loop.mode} for too long"
                name, stood = self.names[0], "a robot that stands"
                raise CheckError(f"robot {name}: {BridgeMode.STANDING_UP}", got, stood)
            loop.turn(None, Wish.STAND)
            if loop.mode is not before:
                before, left = loop.mode, loop.left_ms
            self._idle_rate.wait()
        return True

    def listen(self, estops: Callable[[], str]) -> None:
        self._loop.estops = estops

    def states(self) -> Mapping[str, State]:
        """What the robot measures; nothing at ticks at which it has not said anything new.

        States have even ticks at 500 Hz. At each sample there is one, the newest, unless even that
        is old.
        """
        loop, tick = self._loop, self.tick
        if tick % self.period_ms:
            return {}
        loop.receive()
        report = loop.report
        if report is None:
            return {}
        is_new = loop.report_at > self._published_at
        age = loop.now - loop.report_at
        if not (is_new or (tick % SAMPLE_MS == 0 and age <= _SAMPLE_AGE)):
            return {}
        self._published_at = loop.report_at
        self._arrivals[tick % _REMEMBERED] = tick, loop.arrived
        if self._yaw is None:
            self._yaw = yaw_of(report.quat_wxyz)
        return {self.names[0]: to_state(report, tick, self._yaw)}

    def step(self, commands: Mapping[str, Command]) -> Sequence[Event]:
        """One millisecond of the walk; its first tells of the time before it, too."""
        before = self._take_changes()
        command = commands.get(self.names[0])
        self._loop.turn(self._answer(command), Wish.WALK)
        events = before + self._take_changes()
        self.tick += 1
        return events

    def _answer(self, command: Command | None) -> Answer | None:
        if command is None:
            return None
        place, age = command.tick % _REMEMBERED, self.tick - command.tick
        tick, arrived = self._arrivals[place]
        if tick != command.tick:
            return Answer(command, age)
        self._arrivals[place] = _NOTHING  # sent again, it is no answer
        return Answer(command, age, arrived)

    def idle(self) -> None:
        """A millisecond of standing, while the others are waited for."""
        self._loop.turn(None, Wish.STAND)
        self._idle_rate.wait()

    def finish(self) -> None:
        """Have the robot lie down, switch its motors off, and leave."""
        self._loop.leave()

    def describe(self, status: Status) -> Status:
        """With the bridge's mode and reason, and counters of the robot and of its packets."""
        return self._loop.describe(status)

    def _take_changes(self) -> list[Event]:
        """What the bridge has changed since the last call."""
        changes, self._loop.untold = self._loop.untold, []
        return [self._event(*change) for change in changes]

    def _event(self, at: int, mode: BridgeMode, reason: str) -> Event:
        ms_ago, text = self._loop.now - at, f"{mode} {reason}".rstrip()
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
    way when they start, so that is where all count from. Its feet give raw counts.
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
