"""Packets of the robots against real ones and those that Unitree's own libraries sent and took."""

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

from quadriga.shared.robots.conventions import Array
from quadriga.shared.unitree.codecs import A1, CODECS, GO1, GO2, Codec, crc32
from quadriga.shared.unitree.packets import (
    FOOT_PLACES,
    JOINT_PLACES,
    OFF,
    ON,
    SERVO,
    Battery,
    MotorTargets,
    PacketError,
    RobotReport,
)

VECTOR_FILES = Path(__file__).parent / "vectors"
# Of the libraries 3.3.1 and 3.3.4 (A1), 3.5.1 and 3.8.6 (Go1): the values that they were given and
# the bytes they sent, the bytes that they were sent and the values they gave.
VECTORS: list[dict[str, Any]] = json.loads(
    gzip.decompress((VECTOR_FILES / "udp_vectors.json.gz").read_bytes())
)
REAL = json.loads((VECTOR_FILES / "go2_real_packets.json").read_text("utf-8"))
# Offsets in C of Unitree's headers, as a compiler gave them.
COMMAND_AT = (
    "head 0, level 2, frame_reserve 3, serial 4, version 12, bandwidth 20, motor 24, "
    "battery_off 744, remote 748, led 788, fan 800, gpio 802, reserve 804, crc 808"
)
REPORT_AT = (
    "imu 24, motor 80, battery 1040, foot 1084, foot_estimate 1092, tick 1100, remote 1104, "
    "bit_flag 1144, adc_reel 1148, ntc1 1152, ntc2 1153, power_v 1156, power_a 1160, "
    "fan_frequency 1164, reserve 1172, crc 1176"
)
STEPS = {"q": 1e-6, "dq": 1e-5, "tau": 1 / 256, "kp": 1 / 32, "kd": 1 / 16}
IDLE = MotorTargets(np.full(12, SERVO, dtype=np.uint8), *np.zeros((5, 12)))
UDP = pytest.mark.parametrize("codec", [A1, GO1], ids=["a1", "go1"])
ALL = pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS)
SEEDS = st.integers(0, 2**32)


def any_targets(seed: int) -> MotorTargets:
    """Finite numbers within what a packet of 16 bits can hold."""
    random = np.random.default_rng(seed)
    most = np.array([[4.0], [30.0], [127.0], [1000.0], [2000.0]])  # q, dq, tau, kp, kd
    numbers = random.uniform(-most * [[1], [1], [1], [0], [0]], most, (5, 12))
    return MotorTargets(random.choice([OFF, SERVO], 12).astype(np.uint8), *numbers)


def any_report(seed: int) -> RobotReport:
    """Numbers that a robot may send."""
    random = np.random.default_rng(seed)
    angles, rates, torques = random.uniform(-1.0, 1.0, (3, 12)) * [[4.0], [30.0], [60.0]]
    return RobotReport(
        tick=int(random.integers(0, 2**32)),
        quat_wxyz=random.normal(size=4),
        gyro=random.normal(size=3),
        accel=9.81 * random.normal(size=3),
        q=angles,
        dq=rates,
        tau=torques,
        foot=random.integers(-300, 3000, 4).astype(float),
        mode=random.integers(0, 16, 12).astype(np.uint8),
        temperature=random.integers(-40, 100, 12).astype(float),
        lost=random.integers(0, 1000, 12),
        imu_temperature=int(random.integers(-40, 100)),
        remote=random.bytes(40),
        battery=Battery(
            int(random.integers(0, 101)), int(random.integers(-9000, 9000)) / 1e3, 24.0
        ),
    )


def by_definition(packet: bytes) -> int:
    """CRC-32/MPEG-2, byte by byte and bit by bit."""
    register = 0xFFFFFFFF
    for byte in packet:
        register ^= byte << 24
        for _ in range(8):
            register = register << 1 ^ (0x04C11DB7 if register >> 31 else 0)
            register &= 0xFFFFFFFF
    return register


@given(st.binary(max_size=64))
def test_words_count_with_their_most_significant_byte_first(packet: bytes) -> None:
    assert by_definition(b"123456789") == 0x0376E6E7, "the catalogue's check value"
    words = [packet[at : at + 4][::-1] for at in range(0, len(packet) // 4 * 4, 4)]
    assert crc32(packet) == by_definition(b"".join(words))


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
    for name, step in STEPS.items():
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


def test_layouts_and_the_order_of_joints_are_those_of_c() -> None:
    """FR FL RR RL on the wire, hip, thigh, calf of each; ours is FL FR RL RR."""
    assert len(VECTORS) == 96
    assert (GO2.command.itemsize, GO2.report.itemsize) == (812, 1180)
    for layout, places in ((GO2.command, COMMAND_AT), (GO2.report, REPORT_AT)):
        assert layout.fields is not None
        for name, at in (place.split() for place in places.split(", ")):
            assert layout.fields[name][1] == int(at)
    targets = replace(IDLE, mode=np.full(12, ON, np.uint8), q=np.arange(12.0))
    packet = np.frombuffer(GO2.encode_command(targets), GO2.command)[0]
    assert packet["motor"]["q"][:12].tolist() == [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
    assert (packet["motor"]["q"][12:] == np.float32(2.146e9)).all()
    assert set(packet["motor"]["mode"].tolist()) == {ON}


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
    ours = np.frombuffer(GO2.encode_command(read), GO2.command)[0]
    theirs = np.frombuffer(packet, GO2.command)[0]
    for name in ("head", "level"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    np.testing.assert_array_equal(ours["motor"][:12], theirs["motor"][:12])


@ALL
@given(seed=SEEDS)
def test_a_command_comes_back_with_the_packets_resolution(codec: Codec, seed: int) -> None:
    targets = any_targets(seed)
    read = codec.decode_command(codec.encode_command(targets))
    np.testing.assert_array_equal(read.mode, targets.mode)
    for name, step in STEPS.items():
        sent, got = getattr(targets, name), getattr(read, name)
        if codec is GO2 or name in ("q", "dq"):
            np.testing.assert_allclose(got, sent, rtol=1e-7 if name in ("q", "dq") else 1e-6)
        else:
            assert (np.abs(got) <= np.abs(sent)).all(), "never more than what was asked for"
            np.testing.assert_allclose(got, sent, atol=step)


@ALL
@given(seed=SEEDS)
def test_a_report_comes_back(codec: Codec, seed: int) -> None:
    report = any_report(seed)
    read = codec.decode_report(codec.encode_report(report))
    for name in ("quat_wxyz", "gyro", "accel", "q", "dq"):
        np.testing.assert_allclose(getattr(read, name), getattr(report, name), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(read.tau, report.tau, atol=1e-5 if codec is GO2 else 0.5 / 256)
    for name in ("mode", "temperature", "foot"):
        np.testing.assert_array_equal(getattr(read, name), getattr(report, name))
    np.testing.assert_array_equal(read.lost, report.lost if codec is GO2 else 0)
    assert (read.tick, read.remote) == (report.tick, report.remote)
    assert read.imu_temperature == report.imu_temperature
    assert (read.battery is None) == (codec is A1)
    if read.battery is not None and report.battery is not None:
        assert read.battery.charge == report.battery.charge
        assert read.battery.current == pytest.approx(report.battery.current)
        step = 1e-5 if codec is GO2 else 10 * 0.032  # ten cells, each to 32 mV, or a float
        assert read.battery.voltage == pytest.approx(24.0, abs=step)


@UDP
@given(tau=st.floats(-3e38, 3e38))
def test_torques_beyond_the_packet_are_limited_and_never_turned_around(
    codec: Codec, tau: float
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


@ALL
@given(st.data(), st.binary(max_size=1300))
def test_a_damaged_packet_or_any_bytes_are_refused(
    codec: Codec, data: st.DataObject, noise: bytes
) -> None:
    for packet, decode in (
        (bytearray(codec.encode_report(any_report(1))), codec.decode_report),
        (bytearray(codec.encode_command(IDLE)), codec.decode_command),
    ):
        covered = (len(packet) // 4 - 1) * 4
        packet[data.draw(st.integers(0, covered - 1))] ^= data.draw(st.integers(1, 255))
        for wrong in (bytes(packet), noise):
            with pytest.raises(PacketError, match=r"got .*, expected "):
                decode(wrong)


def test_the_size_and_the_check_sum_decide_and_neither_head_nor_level() -> None:
    with pytest.raises(PacketError, match=r"size: got 771 bytes, expected 807") as size:
        GO1.decode_report(A1.encode_report(any_report(1)))
    report = any_report(1)
    packet = bytearray(A1.encode_report(report))
    packet[0] = 0x00
    with pytest.raises(PacketError, match=r"crc: got \w{8}, .*its level is 0x00") as crc:
        A1.decode_report(bytes(packet))
    assert (size.value.reason, crc.value.reason) == ("size", "crc")
    packet[-4:] = crc32(bytes(packet[:764])).to_bytes(4, "little")
    assert A1.decode_report(bytes(packet)).tick == report.tick
