"""Packets of A1 and Go1 against those that Unitree's own libraries sent and took."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.robot.conventions import Array
from quadriga.shared.unitree.crc import crc32
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    SERVO,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
)
from quadriga.shared.unitree.udp import A1, GO1, UdpCodec
from tests.shared.unitree.packets_of import any_report, any_targets

# Of the libraries 3.3.1 and 3.3.4 (A1), 3.5.1 and 3.8.6 (Go1): the values that they were given and
# the bytes they sent, the bytes that they were sent and the values they gave.
VECTORS: list[dict[str, Any]] = json.loads(
    gzip.decompress((Path(__file__).parent / "vectors" / "udp_vectors.json.gz").read_bytes())
)
CODECS = {"a1": A1, "go1": GO1}
IDLE = MotorTargets(np.full(12, SERVO, dtype=np.uint8), *np.zeros((5, 12)))


def of_motors(vector: dict[str, Any], name: str) -> Array:
    """A field of the vector's motors, in this project's order."""
    values: Array = np.array([motor[name] for motor in vector["motors"]], dtype=float)
    reordered: Array = values[JOINT_PLACES]
    return reordered


@pytest.mark.parametrize("vector", [v for v in VECTORS if v["what"] == "command"])
def test_a_command_is_the_librarys_to_the_byte(vector: dict[str, Any]) -> None:
    codec, wire = CODECS[vector["robot"]], bytes.fromhex(vector["wire"])
    given_ = {name: of_motors(vector, name) for name in ("q", "dq", "tau", "kp", "kd")}
    targets = MotorTargets(of_motors(vector, "mode").astype(np.uint8), **given_)
    assert codec.encode_command(targets) == wire
    read = codec.decode_command(wire)
    np.testing.assert_array_equal(read.mode, targets.mode)
    for name, step in {"q": 1e-6, "dq": 1e-5, "tau": 1 / 256, "kp": 1 / 32, "kd": 1 / 16}.items():
        np.testing.assert_allclose(getattr(read, name), given_[name], atol=step)


@pytest.mark.parametrize("vector", [v for v in VECTORS if v["what"] == "state"])
def test_a_report_is_read_as_the_library_reads_it(vector: dict[str, Any]) -> None:
    read = CODECS[vector["robot"]].decode_report(bytes.fromhex(vector["wire"]))
    imu = vector["imu"]
    for name in ("q", "dq", "tau", "mode", "temperature"):
        np.testing.assert_array_equal(getattr(read, name), of_motors(vector, name))
    np.testing.assert_array_equal(read.quat_wxyz, imu["quat_wxyz"])
    np.testing.assert_array_equal(read.gyro, imu["gyro"])
    np.testing.assert_array_equal(read.accel, imu["accel"])
    np.testing.assert_array_equal(read.foot, np.array(vector["foot_force"])[FOOT_PLACES])
    assert (read.tick, read.imu_temperature) == (vector["tick"], imu["temperature"])
    assert read.remote.hex() == vector["remote"]


def test_every_vector_is_of_a_robot_that_is_known_here() -> None:
    assert len(VECTORS) == 96
    assert {vector["what"] for vector in VECTORS} == {"command", "state"}


@pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
@given(targets=any_targets())
def test_a_command_comes_back_with_the_packets_resolution(
    codec: UdpCodec, targets: MotorTargets
) -> None:
    read = codec.decode_command(codec.encode_command(targets))
    np.testing.assert_array_equal(read.mode, targets.mode)
    np.testing.assert_allclose(read.q, targets.q, rtol=1e-7)
    np.testing.assert_allclose(read.dq, targets.dq, rtol=1e-7)
    for name, step in {"tau": 1 / 256, "kp": 1 / 32, "kd": 1 / 16}.items():
        sent, got = getattr(targets, name), getattr(read, name)
        assert (np.abs(got) <= np.abs(sent)).all(), "never more than what was asked for"
        np.testing.assert_allclose(got, sent, atol=step)


@pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
@given(report=any_report())
def test_a_report_comes_back(codec: UdpCodec, report: RobotReport) -> None:
    read = codec.decode_report(codec.encode_report(report))
    for name in ("quat_wxyz", "gyro", "accel", "q", "dq"):
        np.testing.assert_allclose(getattr(read, name), getattr(report, name), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(read.tau, report.tau, atol=0.5 / 256)
    for name in ("mode", "temperature", "foot"):
        np.testing.assert_array_equal(getattr(read, name), getattr(report, name))
    assert (read.tick, read.remote) == (report.tick, report.remote)
    assert read.imu_temperature == report.imu_temperature
    assert report.battery is not None
    if codec is GO1:
        assert read.battery is not None
        assert read.battery.charge == report.battery.charge
        assert read.battery.current == pytest.approx(report.battery.current)
    else:
        assert read.battery is None


def test_the_go1_tells_the_voltage_of_its_cells() -> None:
    report = replace(_report(), battery=Battery(80, -3.5, 24.0))
    read = GO1.decode_report(GO1.encode_report(report)).battery
    assert read is not None
    assert (read.charge, read.current) == (80, -3.5)
    assert read.voltage == pytest.approx(24.0, abs=10 * 0.032)


@pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
@given(tau=st.floats(-3e38, 3e38))
def test_torques_beyond_the_packet_are_limited_and_never_turned_around(
    codec: UdpCodec, tau: float
) -> None:
    targets = replace(IDLE, tau=np.full(12, tau), kp=np.full(12, abs(tau)))
    read = codec.decode_command(codec.encode_command(targets))
    limited = min(max(tau, -128.0), 127.99609375)
    np.testing.assert_allclose(read.tau, limited, atol=1 / 256)
    assert (read.kp >= 0.0).all()


@pytest.mark.parametrize("name", ["q", "dq", "tau", "kp", "kd"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300])
def test_a_command_that_is_no_number_is_refused(name: str, value: float) -> None:
    numbers = np.zeros(12)
    numbers[5] = value
    with pytest.raises(PacketError, match=f"motor command: {name}"):
        A1.encode_command(replace(IDLE, **dict[str, Any]({name: numbers})))


@pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
@given(st.data())
def test_a_damaged_packet_is_refused(codec: UdpCodec, data: st.DataObject) -> None:
    packet = bytearray(codec.encode_report(_report()))
    covered = (len(packet) // 4 - 1) * 4
    at = data.draw(st.integers(0, covered - 1))
    packet[at] ^= data.draw(st.integers(1, 255))
    with pytest.raises(PacketError):
        codec.decode_report(bytes(packet))


@pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
@given(st.binary(max_size=900))
def test_any_bytes_are_a_packet_or_one_clear_error(codec: UdpCodec, packet: bytes) -> None:
    with pytest.raises(PacketError, match=r"got .*, expected "):
        codec.decode_report(packet)
    with pytest.raises(PacketError, match=r"got .*, expected "):
        codec.decode_command(packet)


def test_the_size_and_the_check_sum_decide_and_neither_head_nor_level() -> None:
    with pytest.raises(PacketError, match=r"size: got 771 bytes, expected 807") as size:
        GO1.decode_report(A1.encode_report(_report()))
    packet = bytearray(A1.encode_report(_report()))
    packet[0] = 0x00
    with pytest.raises(PacketError, match=r"crc: got \w{8}, .*its level is 0x00") as crc:
        A1.decode_report(bytes(packet))
    assert (size.value.reason, crc.value.reason) == ("size", "crc")
    packet[-4:] = crc32(bytes(packet[:764])).to_bytes(4, "little")
    assert A1.decode_report(bytes(packet)).tick == 1


def _report() -> RobotReport:
    zeros = np.zeros(12)
    return RobotReport(1, np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3), zeros, zeros, zeros)
