"""Packets of every kind of damage through a bridge's driver and its supervisor.

No packet may raise an exception, and no command that leaves may hold a torque beyond limits.
"""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np
import pytest

from quadriga.bridges.drivers import RobotDriver
from quadriga.bridges.limits import joint_limits, shares_of_speed
from quadriga.bridges.plant import to_state
from quadriga.bridges.supervisor import (
    BridgeMode,
    Request,
    Supervisor,
    SupervisorInputs,
    SupervisorState,
)
from quadriga.plant.commands import MOST_KD, MOST_KP
from quadriga.shared.codec import decode, encode
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Command
from quadriga.shared.unitree.codecs import CODECS, GO2, Codec, seal
from quadriga.shared.unitree.packets import SERVO, MotorTargets, RobotReport
from tests.bridges.robots import config_of, standing

KINDS: Final = ("a1", "go1", "go2")
_BEGINNINGS: Final = (BridgeMode.PASSIVE, BridgeMode.STAND, BridgeMode.WALK)
_REQUESTS: Final = (*Request, *20 * (Request.WALK,))
_ANEW: Final = 0.3  # share of steps of a stopped robot after which it is in some other state
_EXTREMES: Final = np.array(
    [np.nan, np.inf, -np.inf, 3e38, -3e38, 1e30, 1e5, -1e3, 1e-40, 0.0], np.float32
)


class FuzzedDriver(RobotDriver):
    """A driver without a network: `arrived` has come from the robot, `sent` goes to it."""

    servo, packets_ms = SERVO, 1

    def __init__(self, codec: Codec) -> None:
        super().__init__()
        self.codec, self.arrived, self.sent = codec, b"", b""

    def receive(self) -> RobotReport | None:
        return self._read(self.codec, self.arrived)

    def send(self, targets: MotorTargets) -> None:
        self.sent = self.codec.encode_command(targets)

    def close(self) -> None: ...


class Damage:
    """Makes packets of a good one: noise, cut, torn, or forged with a right check sum.

    Args:
        good: the packet.
        seed: of the damage.
    """

    def __init__(self, good: bytes, seed: int) -> None:
        self._good, self._random = np.frombuffer(good, np.uint8), np.random.default_rng(seed)

    def packet(self) -> bytes:
        """The next one."""
        random, packet = self._random, self._good.copy()
        kind = random.integers(6)
        if kind == 0:
            return random.bytes(int(random.integers(0, 1500)))
        if kind == 1:
            return packet[: random.integers(0, len(packet) + 1)].tobytes()
        if kind == 2:
            for _ in range(random.integers(1, 9)):
                packet[random.integers(len(packet))] ^= 1 << random.integers(8)
            return packet.tobytes()
        where = random.integers(22, len(packet) - 8, size=random.integers(1, 40))
        if kind == 3:
            packet[where] = random.integers(0, 256, size=len(where), dtype=np.uint8)
        elif kind == 4:
            for at in where:
                packet[at : at + 4] = np.frombuffer(random.choice(_EXTREMES).tobytes(), np.uint8)
        return seal(packet.tobytes())


class Fuzz:
    """One robot and its bridge.

    Attributes:
        counts: packets and commands by what became of them.
    """

    def __init__(self, kind: str, seed: int) -> None:
        config, self._driver = config_of(kind), FuzzedDriver(CODECS.get(kind, GO2))
        self._random = np.random.default_rng([seed, 1])
        self._supervisor = Supervisor(config.robot, config.bridge, SERVO)
        self._limits = joint_limits(config.bridge, config.robot)
        report = self._good = standing(config)
        self._damage = Damage(self._driver.codec.encode_report(report), seed)
        good = np.stack([np.zeros(12), config.robot.q_stand, *np.ones((3, 12))])
        self._command: Command | None = None
        self._agent = Damage(encode(Command(1, 0, *good)), seed + 1)
        self._report, self._age = report, 0
        self._state = self._begin(0)
        self.counts: Counter[str] = Counter()

    def _begin(self, now: int) -> SupervisorState:
        """A state that a bridge may be in, and what follows it by some request."""
        passive = self._supervisor.initial(now, armed=True)
        state = replace(passive, mode=_BEGINNINGS[self._random.integers(len(_BEGINNINGS))])
        request = list(Request)[self._random.integers(len(Request))]
        inputs = SupervisorInputs(now, self._good, 0, request=request)
        return self._supervisor.step(state, inputs)[0]

    def run(self, packets: int) -> None:
        """Send packets.

        Raises:
            AssertionError: a command that left is beyond the limits.
        """
        for now in range(1, packets + 1):
            if self._state.mode is BridgeMode.ESTOP and self._random.random() < _ANEW:
                self._state, self._report = self._begin(now), self._good
            self._turn(now)

    def _turn(self, now: int) -> None:
        self._driver.arrived = self._damage.packet()
        report = self._driver.receive()
        self._age = 0 if report is not None else self._age + 1
        if report is not None:
            self._report = report
            self.counts["accepted"] += 1
            encode(to_state(report, now, 0.3))
        # A plant lets through less: a supervisor must not depend on that.
        with suppress(MessageError):
            self._command = decode(self._agent.packet(), Command)
        inputs = SupervisorInputs(
            now=now,
            report=self._report,
            report_age=self._age,
            command=self._command,
            command_age=int(self._random.integers(0, 60)),
            request=_REQUESTS[self._random.integers(len(_REQUESTS))],
        )
        self._state, supervised = self._supervisor.step(self._state, inputs)
        self.counts[str(self._state.mode)] += 1
        if supervised.targets is not None:
            self._driver.send(supervised.targets)
            self._check(self._driver.sent)

    def _check(self, packet: bytes) -> None:
        """What arrives at the robot holds numbers, gains, and torques within the limits."""
        self.counts["commands"] += 1
        targets, limits = self._driver.codec.decode_command(packet), self._limits
        assert (np.abs(targets.tau) <= limits.torque + 0.01).all(), targets
        assert ((targets.kp >= 0.0) & (targets.kp <= MOST_KP)).all(), targets
        assert ((targets.kd >= 0.0) & (targets.kd <= MOST_KD)).all(), targets
        on, damped = targets.kp > 0.0, targets.kd > 0.0
        within = (targets.q >= limits.lower - 1e-6) & (targets.q <= limits.upper + 1e-6)
        assert within[on].all(), targets
        assert (np.abs(targets.dq) <= limits.speed + 1e-6)[damped].all(), targets
        q, dq = self._report.q, self._report.dq
        known = np.isfinite(shares_of_speed(q, dq, limits.speed, limits))
        asked = np.array([targets.tau, targets.kp, targets.q, targets.kd, targets.dq])[:, known]
        tau, kp, angle, kd, rate = asked
        torque = tau + kp * (angle - q[known]) + kd * (rate - dq[known])
        # A packet's gains have 16 bits and are cut to their steps, 1/32 and 1/16.
        cut = np.abs(angle - q[known]) / 32.0 + np.abs(rate - dq[known]) / 16.0
        assert (np.abs(torque) <= limits.torque[known] + cut + 0.01).all(), (targets, torque)


def fuzz(kind: str, packets: int, seed: int) -> Counter[str]:
    """Send damaged packets of a kind of robot; what became of them.

    Raises:
        AssertionError: a command that left is beyond the limits.
    """
    with np.errstate(all="ignore"):  # numbers that are none
        robot = Fuzz(kind, seed)
        robot.run(packets)
    return robot.counts


@pytest.mark.parametrize("kind", KINDS)
def test_no_packet_is_an_exception_or_a_torque_beyond_limits(kind: str) -> None:
    counts = fuzz(kind, 3000, seed=7)
    assert counts["commands"] == 3000
    assert 1000 < counts["accepted"] < 2400, "forged ones are obeyed, damaged ones are not"
    for mode in BridgeMode:
        assert mode is BridgeMode.DRY or counts[mode] >= 3, counts


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_a_hundred_thousand_packets(kind: str) -> None:
    assert fuzz(kind, 100_000, seed=0)["commands"] == 100_000
