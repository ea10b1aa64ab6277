"""Packets of the Go2: their layout in C, what is in them, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.unitree import go2
from quadriga.shared.unitree.go2 import GO2
from quadriga.shared.unitree.packets import ON, MotorTargets, PacketError, RobotReport
from tests.shared.unitree.packets_of import any_report, any_targets

REAL = json.loads((Path(__file__).parent / "vectors" / "go2_real_packets.json").read_text("utf-8"))
# Offsets in C of Unitree's headers, as a compiler gave them.
COMMAND_AT = {
    "head": 0,
    "level": 2,
    "frame_reserve": 3,
    "serial": 4,
    "version": 12,
    "bandwidth": 20,
    "motor": 24,
    "battery_off": 744,
    "remote": 748,
    "led": 788,
    "fan": 800,
    "gpio": 802,
    "reserve": 804,
    "crc": 808,
}
REPORT_AT = {
    "imu": 24,
    "motor": 80,
    "battery": 1040,
    "foot": 1084,
    "foot_estimate": 1092,
    "tick": 1100,
    "remote": 1104,
    "bit_flag": 1144,
    "adc_reel": 1148,
    "ntc1": 1152,
    "ntc2": 1153,
    "power_v": 1156,
    "power_a": 1160,
    "fan_frequency": 1164,
    "reserve": 1172,
    "crc": 1176,
}


def test_the_layouts_are_those_of_c() -> None:
    assert (go2.COMMAND.itemsize, go2.REPORT.itemsize) == (812, 1180)
    for layout, offsets in ((go2.COMMAND, COMMAND_AT), (go2.REPORT, REPORT_AT)):
        assert layout.fields is not None
        assert {name: layout.fields[name][1] for name in offsets} == offsets


@pytest.mark.parametrize("packet", [bytes.fromhex(text) for text in REAL["lowstate"]])
def test_what_a_real_robot_sent_is_read(packet: bytes) -> None:
    """It stands, its level is 0, and what a simulated one sends differs in values alone."""
    report = GO2.decode_report(packet)
    assert report.q[2::3] == pytest.approx([-1.556, -1.525, -1.522, -1.567], abs=1e-3)
    assert (report.temperature[8], report.temperature[11]) == (78.0, 72.0)
    assert np.linalg.norm(report.accel) == pytest.approx(9.6, abs=0.1)
    assert report.foot.tolist() == [29.0, 16.0, 13.0, 33.0]
    assert report.battery is not None
    assert (report.battery.charge, report.battery.voltage) == pytest.approx((63, 29.54), abs=0.01)
    assert set(report.mode.tolist()) == {ON}
    assert GO2.encode_report(report)[:3] == packet[:3]


def test_a_command_is_the_one_that_a_real_robot_was_sent() -> None:
    (packet,) = map(bytes.fromhex, REAL["lowcmd"])
    read = GO2.decode_command(packet)
    assert set(read.kp.tolist()) == {40.0}
    ours = np.frombuffer(GO2.encode_command(read), go2.COMMAND)[0]
    theirs = np.frombuffer(packet, go2.COMMAND)[0]
    for name in ("head", "level"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    np.testing.assert_array_equal(ours["motor"][:12], theirs["motor"][:12])


@given(any_targets())
def test_a_command_comes_back(targets: MotorTargets) -> None:
    read = GO2.decode_command(GO2.encode_command(targets))
    np.testing.assert_array_equal(read.mode, targets.mode)
    for name in ("q", "dq", "tau", "kp", "kd"):
        np.testing.assert_allclose(getattr(read, name), getattr(targets, name), rtol=1e-6)


@given(any_report())
def test_a_report_comes_back(report: RobotReport) -> None:
    assert report.battery is not None
    report = replace(report, battery=replace(report.battery, voltage=28.5))
    read = GO2.decode_report(GO2.encode_report(report))
    for name in ("quat_wxyz", "gyro", "accel", "q", "dq", "tau"):
        np.testing.assert_allclose(getattr(read, name), getattr(report, name), rtol=1e-6, atol=1e-6)
    for name in ("mode", "temperature", "foot", "lost"):
        np.testing.assert_array_equal(getattr(read, name), getattr(report, name))
    assert (read.tick, read.remote) == (report.tick, report.remote)
    assert read.battery is not None
    assert report.battery is not None
    assert (read.battery.charge, read.battery.voltage) == (report.battery.charge, 28.5)
    assert read.battery.current == pytest.approx(report.battery.current)


def test_the_order_of_joints_is_the_robots() -> None:
    """FR FL RR RL on the wire, hip, thigh, calf of each; ours is FL FR RL RR."""
    idle = np.zeros(12)
    targets = MotorTargets(np.full(12, ON, np.uint8), np.arange(12.0), idle, idle, idle, idle)
    packet = np.frombuffer(GO2.encode_command(targets), go2.COMMAND)[0]
    assert packet["motor"]["q"][:12].tolist() == [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
    assert (packet["motor"]["q"][12:] == np.float32(2.146e9)).all()
    assert set(packet["motor"]["mode"].tolist()) == {ON}


@given(st.data())
def test_a_damaged_packet_is_refused(data: st.DataObject) -> None:
    idle = np.zeros(12)
    targets = MotorTargets(np.full(12, ON, np.uint8), idle, idle, idle, idle, idle)
    packet = bytearray(GO2.encode_command(targets))
    packet[data.draw(st.integers(0, len(packet) - 1))] ^= data.draw(st.integers(1, 255))
    with pytest.raises(PacketError):
        GO2.decode_command(bytes(packet))


@given(st.binary(max_size=1300))
def test_any_bytes_are_a_packet_or_one_clear_error(packet: bytes) -> None:
    for decode in (GO2.decode_report, GO2.decode_command):
        with pytest.raises(PacketError, match=r"got .*, expected "):
            decode(packet)
