"""SHELL of the plant of one real robot: it stands up for the team's walk, and lies down after."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.bridges.checks import check_reports, refuse_failed
from quadriga.bridges.drivers import RobotDriver, open_driver
from quadriga.bridges.supervisor import (
    BridgeMode,
    Request,
    Supervised,
    Supervisor,
    SupervisorInputs,
    SupervisorState,
)
from quadriga.bridges.watchdog import BEAT_MS, Watchdog
from quadriga.plant.protocol import Plant
from quadriga.shared import codes
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError, ConfigError
from quadriga.shared.messages import Command, Event, State, Status
from quadriga.shared.printable import printable_line
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.runtime.histogram import Histogram
from quadriga.shared.topics import SAMPLE_MS
from quadriga.shared.unitree.packets import RobotReport

TICK: Final = 1e-3  # s
_SLACK_MS: Final = 3000  # beyond what a motion takes
_LOOK_MS: Final = 1000  # of reports that are checked before the robot is commanded
_FIND_MS: Final = 3000  # for the first of them to come
_INTRODUCE_MS: Final = 500  # between two packets to a robot that is silent
_ANSWER_BIN: Final = 0.05  # ms
_WARN_MS: Final = 1000, 60_000  # from a look for what to warn of to the next, and from a warning
_LEAVE_MS: Final = 100  # of packets at the end, that one of them arrives
_SAMPLE_AGE: Final = 5  # ms, that a report may be old at a sample of which there is no newer one
_REMEMBERED: Final = 64  # states, for which the arrival of their reports is known


class RobotPlant(Plant):
    """One robot, at the end of its driver; see `Plant`.

    No motor is enabled before `take_charge`, and never in a dry run, without a watchdog: that
    brings the robot to rest when this process dies or hangs. `say` tells the operator what happens.

    Attributes:
        supervision: what the supervisor remembers.
        now: ms since this was made.
        report: the robot's newest; None before the first.
        report_at: when it came, ms.
    """

    is_robot = True

    def __init__(
        self,
        config: Config,
        name: str,
        driver: RobotDriver,
        *,
        watchdog: Watchdog | None,
        say: Callable[[str], None],
    ) -> None:
        self.names, self.tick = (name,), 0  # ticks begin with the walk
        self._config, self._name, self.period_ms = config, name, driver.period_ms
        self._driver, self._watchdog, self._say = driver, watchdog, say
        self._clock, self._turned_at = monotonic, monotonic()
        self._idle_rate = Rate(TICK, slack=3.0)
        self._supervisor = Supervisor(config.robot, config.bridge, driver.servo)
        self.supervision: SupervisorState = self._supervisor.initial(0, armed=watchdog is not None)
        self.now = 0
        self.report: RobotReport | None = None
        self.report_at, self._arrived = -1, 0.0  # the same by the clock, s
        self._sent_at, self._warn_at = 0, 0
        self._estops: Callable[[], str] = str  # why the team's was pressed, "" if it was not
        self._announce: Callable[[Event], None] = lambda _event: None
        self._answers = Histogram(_ANSWER_BIN)  # from reports to the commands made of them, ms
        self._in_charge = False  # of the robot's motors
        self._watchdog_gone = False
        self._cut: Counter[str] = Counter()
        self._published_at = -1
        self._arrivals = dict[int, float]()  # by tick of a state that has no command yet, s
        self._yaw: float | None = None

    @property
    def mode(self) -> BridgeMode:
        """What the supervisor lets the robot do now."""
        return self.supervision.mode

    def look(self, stopped: Callable[[], bool], *, hung: bool = False, tells: bool = True) -> bool:
        """Check a second of reports of a robot that lies or hangs; False if `stopped()` is first.

        Raises:
            CheckError: the robot is not as it must be.
        """
        driver, rate, reports = self._driver, Rate(TICK), list[RobotReport]()
        malformed = driver.counters["malformed"]
        for ms in range(_FIND_MS):
            if stopped():
                return False
            self._begin_turn()
            if self._receive():
                break
            if ms % _INTRODUCE_MS == 0:
                driver.introduce()
            rate.wait()
        while self._receive():  # what came before this second
            pass
        before = driver.counters["received"]
        for _ in range(_LOOK_MS):
            if stopped():
                return False
            self._begin_turn()
            if self._receive() and self.report is not None:
                reports.append(self.report)
            rate.wait()
        malformed = driver.counters["malformed"] - malformed
        cause = f"{malformed} malformed, the last one {driver.malformed}" if malformed else ""
        config, received = self._config, driver.counters["received"] - before
        way = _LOOK_MS / 1000, driver.packets_ms, config.bridge, config.robot
        findings = check_reports(reports, *way, received=received, hung=hung, cause=cause)
        for finding in findings if tells else ():
            self._say(f"{finding.name}: {finding.got}{'' if finding.ok else '  <- not right'}")
        refuse_failed(self._name, findings)
        return True

    def prepare(self, stopped: Callable[[], bool]) -> bool:
        """Look at the robot's reports, and get it to stand if it may be commanded.

        Raises:
            CheckError: the robot is not as it must be, or does not stand when it should.
            BridgeError: its own controller does not let go of the motors.
        """
        if not self.look(stopped, tells=False):
            return False
        if self._watchdog is None:
            self._say(f"{self._name}: dry run, no motor is enabled; --armed commands the robot")
            return True
        self.take_charge()
        self._move(Request.STAND, (BridgeMode.STAND, BridgeMode.ESTOP), stopped)
        if stopped():
            return False
        if self.mode is not BridgeMode.STAND:
            what = f"robot {self._name}: {BridgeMode.STANDING_UP}"
            got = self.supervision.reason or f"{self.mode} for too long"
            raise CheckError(what, got, "a robot that stands")
        return True

    def _move(
        self, request: Request, ends: Collection[BridgeMode], stopped: Callable[[], bool] = bool
    ) -> None:
        """Ask for it until the robot is in one of these modes, `stopped()`, or a mode lasts."""
        before, left = self.mode, self._left_ms
        while self.mode not in ends and left > 0 and not stopped():
            self.turn(request)
            self._idle_rate.wait()
            if self.mode is not before:
                before, left = self.mode, self._left_ms
            left -= 1

    def take_charge(self) -> None:
        """Have the robot's own controller let go of the motors, or raise; and answer for them."""
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

    def listen(self, estops: Callable[[], str], announce: Callable[[Event], None]) -> None:
        self._estops, self._announce = estops, announce

    def states(self) -> Mapping[str, State]:
        """What the robot measures; nothing at ticks at which it has not said anything new.

        States have even ticks at 500 Hz. At each sample there is one, the newest, unless even that
        is old.
        """
        tick = self.tick
        if tick % self.period_ms:
            return {}
        self._receive()
        if (report := self.report) is None:
            return {}
        is_new, age = self.report_at > self._published_at, self.now - self.report_at
        if not (is_new or (tick % SAMPLE_MS == 0 and age <= _SAMPLE_AGE)):
            return {}
        self._published_at = self.report_at
        self._arrivals[tick] = self._arrived
        if len(self._arrivals) > _REMEMBERED:
            del self._arrivals[next(iter(self._arrivals))]
        if self._yaw is None:
            self._yaw = yaw_of(report.quat_wxyz)
        return {self._name: to_state(report, tick, self._yaw)}

    def step(self, commands: Mapping[str, Command]) -> Sequence[Event]:
        """One millisecond of the walk; what happens in it goes to whoever listens."""
        self.turn(Request.WALK, commands.get(self._name))
        self.tick += 1
        return ()

    def idle(self) -> None:
        """A millisecond of standing, while the others are waited for."""
        self.turn(Request.STAND)
        self._idle_rate.wait()

    def turn(self, request: Request, command: Command | None = None) -> Supervised | None:
        """A millisecond: receive, decide, send.

        The agent's new `command` is sent at once, and some command once in a period at least.

        Returns:
            What was decided; None between two commands, and before the first report.
        """
        self._begin_turn()
        # None if there is no command, or that of this state has been sent already.
        arrived = None if command is None else self._arrivals.pop(command.tick, None)
        if arrived is None and self.now - self._sent_at < self.period_ms:
            return None
        if self.now - self.report_at >= self.period_ms:
            self._receive()
        if (report := self.report) is None:
            return None
        inputs = SupervisorInputs(
            now=self.now,
            report=report,
            report_age=self.now - self.report_at,
            command=command,
            command_age=0 if command is None else self.tick - command.tick,
            request=request,
            writers=self._driver.other_writers(),
            stall=self._stall(),
            watched=not self._watchdog_gone,
            estop=self._estops(),
        )
        self.supervision, supervised = self._supervisor.step(self.supervision, inputs)
        self._cut.update(supervised.cut)
        self._sent_at = self.now
        if supervised.targets is not None:
            self._driver.send(supervised.targets)
            if arrived is not None:
                self._answers.add(1e3 * (self._clock() - arrived))
        changes = [*supervised.changes]
        if inputs.estop and not changes and self.mode is BridgeMode.ESTOP:
            changes = [(self.mode, self.supervision.reason)]  # who presses again waits for its word
        if self.now >= self._warn_at and self.mode is not BridgeMode.ESTOP:
            warning = self._supervisor.warning(report)
            self._warn_at = self.now + _WARN_MS[bool(warning)]
            changes += [(self.mode, warning)] if warning else []
        for mode, reason in changes:
            text = f"{mode} {reason}".rstrip()
            self._say(f"{self._name}: {text}")
            code = codes.ROBOT_STOPPED if mode is BridgeMode.ESTOP else codes.BRIDGE_MODE
            self._announce(Event.of(self.tick, code, self._name, text))
        return supervised

    def finish(self) -> None:
        """Have the robot lie down, switch its motors off, and leave."""
        if self._in_charge:
            self._move(Request.LIE, (BridgeMode.DRY, BridgeMode.PASSIVE, BridgeMode.ESTOP))
            passive = round(1000 * self._config.bridge.passive_s)
            for _ in range(_LEAVE_MS + (passive if self.mode is BridgeMode.ESTOP else 0)):
                self.turn(Request.REST)
                self._idle_rate.wait()
        if self._watchdog is not None:
            self._watchdog.dismiss()
        self._driver.close()

    @property
    def _left_ms(self) -> int:
        """How long the motion that is made now may take, ms."""
        motion = self.supervision.motion
        seconds = self._config.bridge.stand_s if motion is None else motion.seconds
        return round(1000.0 * seconds) + _SLACK_MS

    def describe(self, status: Status) -> Status:
        """With the bridge's mode and reason, and counters of the robot and of its packets.

        `<robot>.answer` of `ages_ms`: from the arrival of a report to the command made of it.
        """
        ages = {**status.ages_ms, **self._answers.quantiles(f"{self._name}.answer")}
        counters = {**status.counters, **self._driver.counters}
        counters |= {f"limited_{name}": count for name, count in self._cut.items()}
        if (report := self.report) is not None:
            counters["hottest_c"] = int(np.max(report.temperature))
            counters["motors_lost"] = int(np.sum(report.lost))
            if report.battery is not None:
                counters["battery_percent"] = report.battery.charge
        mode, reason = str(self.mode), self.supervision.reason
        return replace(status, mode=mode, reason=reason, ages_ms=ages, counters=counters)

    def _begin_turn(self) -> None:
        """Count a millisecond, and tell the watchdog that there is one."""
        self.now += 1
        if self._in_charge and self._watchdog is not None and self.now % BEAT_MS == 0:
            self._watchdog_gone = not self._watchdog.beat()

    def _receive(self) -> bool:
        """Take the newest report; whether one has come."""
        report = self._driver.receive()
        if report is None:
            return False
        self.report, self.report_at, self._arrived = report, self.now, self._clock()
        return True

    def _stall(self) -> int:
        """Milliseconds since this was asked last: more than one if the process stood still."""
        before, self._turned_at = self._turned_at, self._clock()
        return round(1000.0 * (self._turned_at - before))


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
    quat = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    r = report
    return State(tick, tick * 1_000_000, r.q, r.dq, r.tau, quat, r.gyro, r.accel, r.foot)


def build_bridge(
    config: Config,
    names: tuple[str, ...],
    *,
    armed: bool = False,
    stopped: Callable[[], bool] = bool,
) -> RobotPlant:
    """The plant of one robot behind its bridge, which has looked at it; a `PlantFactory`.

    Raises:
        ConfigError: more than one robot, or no address or interface that can be used.
        BridgeError: the way to the robot cannot be opened.
        CheckError: the robot is not as it must be.
    """
    if len(names) != 1:
        raise ConfigError("team.plant_per_robot", f"a plant of {', '.join(names)}", "true")
    kind, bridge = config.team.robot, config.bridge.of_robot(names[0])
    driver = open_driver(kind, bridge)
    watchdog = Watchdog(kind, bridge) if armed else None
    plant = RobotPlant(config, names[0], driver, watchdog=watchdog, say=say)
    try:
        plant.look(stopped)
    except BaseException:
        plant.finish()
        raise
    return plant


def say(text: str) -> None:
    print(printable_line(f"bridge: {text}"), file=sys.stderr, flush=True)
