"""Faults of sensors and motors: which parts of a robot can be faulty, and what they then say.

`world.faults` and live faults follow one grammar: 'robot/component kind start[s] [duration[s]]',
commas between faults.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.shared import codes
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.messages import Command, Event, Flat, State
from quadriga.shared.robots.conventions import JOINT_NAMES, N_LEGS, Array, Leg, robot_names
from quadriga.shared.robots.spec import RobotSpec
from quadriga.sim_server.world.scenario import LATEST, read_items, read_number

OFF: Final = "off"
STUCK: Final = "stuck"
GARBAGE: Final = "garbage"
WRONG: Final = "wrong"
SLOW: Final = "slow"
DELAYED: Final = "delayed"
INTERMITTENT: Final = "intermittent"
# By name, what a faulty component does. The words are those of PX4's failure injection.
KINDS: Final = {
    OFF: "zero; a motor gives no torque",
    STUCK: "the last sound value",
    GARBAGE: "chance, within the component's range, anew every millisecond",
    WRONG: "rates, forces and torques with the opposite sign, angles 0.2 rad off",
    SLOW: "a new value every 50 ms only",
    DELAYED: "50 ms late",
    INTERMITTENT: "off for a random half of all spans of 50 ms",
}
SPAN_MS: Final = 50  # of what is slow, delayed or intermittent
_AHEAD_MS: Final = SPAN_MS + 10  # from a request to the fault that it asks for
_KEY: Final = "world.faults"
_GRAMMAR: Final = "'robot/component kind start[s] [duration[s]]', commas between faults"
_STREAM: Final = 5  # of the seed; terrain, sensors, pushes and motors draw from others
_OFF_BY: Final = 0.2  # rad, an angle that is wrong
_GYRO_MOST: Final = 35.0  # rad/s, 2000 °/s: the range of usual gyros
_ACCEL_MOST: Final = 157.0  # m/s², 16 g: the range of usual accelerometers
_ALL: Final = slice(None)
_FOOT_MOST: Final = 500.0  # counts, or N: more than a foot of such a robot presses

Columns = NDArray[np.intp]


class Component(NamedTuple):
    """A part of a robot that can be faulty."""

    message: type[Flat]  # `State` of a sensor, `Command` of a motor
    columns: Columns  # its numbers in the message's row
    low: Array  # between this and `high` it draws its numbers when it gives garbage
    high: Array
    wrong: Callable[[Array], Array] = np.negative  # from sound to wrong numbers
    unit_length: bool = False  # whether they are an orientation: garbage has unit length


def build_components(robot: RobotSpec) -> Mapping[str, tuple[Component, ...]]:
    """What of a kind of robot can be faulty, by name, with its parts.

    Sensors are `imu`, its parts `attitude`, `gyro` and `accel`, `encoders` with angle and rate of
    all joints and `encoder_FL_hip` …, `feet` and `foot_FL` …; motors are `motors`, `motor_FL` with
    the three of a leg …, and `motor_FL_hip` ….
    """
    speed = np.tile(robot.speed, N_LEGS)
    low, high = np.array([robot.lower, -speed]), np.array([robot.upper, speed])

    def encoders(part: slice) -> Component:
        """Of wrong ones the angles are off and the rates opposite."""
        least, most = low[:, part], high[:, part]
        sign, off = np.repeat([[1.0, -1.0], [_OFF_BY, 0.0]], least.shape[1], axis=1)
        columns = _columns(State, ("q_joint", "v_joint"), part)
        return Component(
            State, columns, least.ravel(), most.ravel(), lambda values: sign * values + off
        )

    def motors(part: slice) -> Component:
        """A wrong one gives the opposite torque."""
        torque = robot.torque_limit[part]
        most = np.concatenate([torque, np.zeros(4 * len(torque))])
        sign = np.repeat([-1.0, -1.0, -1.0, 1.0, 1.0], len(torque))
        columns = _columns(Command, ("tau", "kp", "kd", "q_des", "v_des"), part)
        return Component(Command, columns, -most, most, lambda values: sign * values)

    joints = {n.removesuffix("_joint"): slice(k, k + 1) for k, n in enumerate(JOINT_NAMES)}
    legs = {leg.name: slice(3 * leg, 3 * leg + 3) for leg in Leg}
    parts = {
        "attitude": _sensor("imu_quat_wxyz", -1.0, 1.0)._replace(wrong=_tilt, unit_length=True),
        "gyro": _sensor("imu_gyro", -_GYRO_MOST, _GYRO_MOST),
        "accel": _sensor("imu_accel", -_ACCEL_MOST, _ACCEL_MOST),
        "encoders": encoders(_ALL),
        **{f"encoder_{name}": encoders(joint) for name, joint in joints.items()},
        "feet": _sensor("foot_force", 0.0, _FOOT_MOST),
        **{f"foot_{g.name}": _sensor("foot_force", 0.0, _FOOT_MOST, slice(g, g + 1)) for g in Leg},
        "motors": motors(_ALL),
        **{f"motor_{name}": motors(part) for name, part in (legs | joints).items()},
    }
    imu = tuple(parts[name] for name in ("attitude", "gyro", "accel"))
    return {"imu": imu, **{name: (part,) for name, part in parts.items()}}


def _columns(message: type[Flat], fields: Sequence[str], part: slice) -> Columns:
    cuts = [message.CUTS[field] for field in fields]
    return np.concatenate([np.arange(cut.start, cut.stop)[part] for cut in cuts])


def _sensor(field: str, low: float, high: float, part: slice = _ALL) -> Component:
    """A sensor whose wrong numbers have the opposite sign."""
    columns = _columns(State, (field,), part)
    return Component(State, columns, np.full(len(columns), low), np.full(len(columns), high))


def _tilt(quat_wxyz: Array) -> Array:
    """The orientation, turned by `_OFF_BY` about the trunk's x axis."""
    c, s = np.cos(0.5 * _OFF_BY), np.sin(0.5 * _OFF_BY)
    w, x, y, z = quat_wxyz
    return np.array([c * w - s * x, c * x + s * w, c * y + s * z, c * z - s * y])


class ComponentFault(NamedTuple):
    """What is wrong with one component of one robot, in ticks `start` to `stop` − 1."""

    robot: str  # its name
    component: str  # a name of `build_components`
    kind: str  # a name of `KINDS`
    start: int  # tick, ms
    stop: int | None = None  # None: it never ends

    @property
    def detail(self) -> str:
        """Detail of the event that announces its beginning."""
        return f"{self.component} {self.kind}"


def parse_faults(
    text: str, robots: tuple[str, ...], components: tuple[str, ...]
) -> tuple[ComponentFault, ...]:
    """The faults that a text describes, in the order written; empty text means none.

    Raises:
        ConfigError: the text does not follow the grammar, or names what there is not.
    """
    found = list[ComponentFault]()
    for part, words in read_items(_KEY, text, _GRAMMAR, (3, 4), separator=None):
        robot, slash, component = words[0].partition("/")
        if not slash:
            raise ConfigError(_KEY, repr(part), _GRAMMAR)
        for what, word, known in (
            ("robot", robot, robots),
            ("component", component, components),
            ("kind", words[1], tuple(KINDS)),
        ):
            if word not in known:
                hint = did_you_mean(word, known)
                raise ConfigError(_KEY, f"{what} {word!r}", f"one of {', '.join(known)}", hint)
        start, stop = round(1000 * read_number(_KEY, "start", words[2], part, 0.0, LATEST)), None
        if len(words) == 4:
            duration = read_number(_KEY, "duration", words[3], part, 1e-3, LATEST)
            stop = start + round(1000 * duration)
        fault = ComponentFault(robot, component, words[1], start, stop)
        if fault in found:
            raise ConfigError(_KEY, f"{robot}/{fault.detail} twice", "each fault once")
        found.append(fault)
    return tuple(found)


def with_time(text: str, tick: int) -> str:
    """A fault as `world.faults` has it, of one without its time: it begins some ms after a tick.

    What a faulty component says may depend on what it has said in the 60 ms before.

    Raises:
        ConfigError: there are too few or too many words.
    """
    words = text.split()
    if len(words) not in (2, 3):
        raise ConfigError("fault", repr(text), "'robot/component kind [duration[s]]'")
    return " ".join([*words[:2], f"{1e-3 * (tick + _AHEAD_MS):.3f}", *words[2:]])


class Distortion:
    """One fault at one component, with its own source of chance.

    It remembers what the component said before.
    """

    def __init__(
        self, fault: ComponentFault, component: Component, random: np.random.Generator
    ) -> None:
        self.component = component
        self._fault, self._random = fault, random
        self._sound = deque[Array](maxlen=SPAN_MS + 1)  # the newest sound numbers
        self._held: Array | None = None
        self._off = False

    def distort(self, tick: int, values: Array) -> Array:
        """The component's numbers at a tick, one more than at the last call, of the sound ones."""
        fault, component = self._fault, self.component
        if tick < fault.start or (fault.stop is not None and tick >= fault.stop):
            self._sound.append(values)
            return values
        if fault.kind == DELAYED:
            self._sound.append(values)
            return self._sound[0]
        if self._held is None or (tick - fault.start) % SPAN_MS == 0:
            self._held, self._off = values, bool(self._random.random() < 0.5)
        if fault.kind == OFF or (fault.kind == INTERMITTENT and self._off):
            return np.zeros_like(values)
        if fault.kind == STUCK:
            return self._sound[-1] if self._sound else values
        if fault.kind == WRONG:
            return component.wrong(values)
        if fault.kind == SLOW:
            return self._held
        if fault.kind == GARBAGE:
            drawn = self._random.uniform(component.low, component.high)
            return drawn / np.linalg.norm(drawn) if component.unit_length else drawn
        return values


class Injection:
    """The faults of `world.faults`, and those added later, at the robots `names` of a world.

    Attributes:
        events: when each fault of the configuration begins and ends.

    Raises:
        ConfigError: `world.faults` does not parse, or names what there is not.
    """

    def __init__(self, config: Config, names: Sequence[str]) -> None:
        self._components = build_components(config.robot)
        self._team, self._names = robot_names(config.team.robots), tuple(names)
        self._seed, self._count = config.world.seed, 0
        self._distortions: dict[type[Flat], list[tuple[int, Distortion]]] = {}
        self.events = self.add(config.world.faults)

    def add(self, text: str) -> list[Event]:
        """Add faults that have not begun; when each begins and ends.

        Raises:
            ConfigError: the text does not parse, or names what there is not.
        """
        found = list[Event]()
        for fault in parse_faults(text, self._team, tuple(self._components)):
            robot, component, _, start, stop = fault
            parts = self._components[component] if robot in self._names else ()
            for part, of_part in enumerate(parts):
                chance = np.random.default_rng((self._seed, _STREAM, self._count, part))
                made = self._names.index(robot), Distortion(fault, of_part, chance)
                self._distortions.setdefault(of_part.message, []).append(made)
            self._count += 1
            found.append(Event.of(start, codes.FAULT_BEGINS, robot, fault.detail))
            if stop is not None:
                found.append(Event.of(stop, codes.FAULT_ENDS, robot, f"{component} sound again"))
        return found

    def distort(self, message: type[Flat], tick: int, rows: Array) -> None:
        """Make of the robots' sound rows of a message what is faulty; once a tick, in place.

        Args:
            message: `State` for faulty sensors, `Command` for faulty motors.
            tick: ms.
            rows: of the robots, one below the other.
        """
        for robot, distortion in self._distortions.get(message, ()):
            columns = distortion.component.columns
            rows[robot, columns] = distortion.distort(tick, rows[robot, columns])
