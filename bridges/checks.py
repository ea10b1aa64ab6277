"""What must be true of a robot before a bridge commands it: the first second of its reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import pinocchio

from quadriga.bridges.supervisor import tilt_of
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.errors import CheckError
from quadriga.shared.robots.conventions import FOOT_FRAMES, GRAVITY, JOINT_NAMES, N_LEGS, Array
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.unitree.packets import PROTECTED, RobotReport

_FLAT: Final = 0.6  # rad, tilt at which a robot still lies as it should
_GRAVITY_OFF: Final = 1.5  # m/s²
_VERTICAL_OFF: Final = 0.25  # rad between the accelerometer's vertical and the attitude's
_STILL_GYRO, _STILL_JOINT = 0.3, 0.5  # rad/s
_TOUCHES: Final = 0.05  # m above the lowest point of a robot, that may touch the ground, too
_BESIDE: Final = 0.03  # m, of the centre of mass beside what bears it
_DIRECTIONS: Final = 72
_BEYOND: Final = 0.25  # rad beyond its range: a Go2 that lies has its calves 0.09 beyond it
_LIMB_RADIUS: Final = 0.02  # m, of knees
_HIP_RADIUS: Final = 0.04  # m, of the motors at hips


class Finding(NamedTuple):
    """What one check came to."""

    name: str  # of the check
    got: str  # what was found
    expected: str  # what would have been right
    ok: bool
    cause: str = ""  # the likely cause if it is not


def check_reports(
    reports: Sequence[RobotReport],
    seconds: float,
    period_ms: int,
    config: BridgeConfig,
    robot: RobotSpec,
    *,
    received: int = 0,
    hung: bool = False,
    cause: str = "",
) -> list[Finding]:
    """Everything that the first reports of a robot that lies or hangs still can tell.

    Args:
        reports: those that were looked at, in their order.
        seconds: for how long they were gathered.
        period_ms: between two reports of a robot that is well.
        config: the limits.
        robot: that it should be.
        received: reports that came: a busy computer looks at the newest of several.
        hung: whether it hangs: then its feet may be at any height.
        cause: why fewer came than should, if that is known.
    """
    received = max(received, len(reports))
    wanted = config.report_share * 1000.0 * seconds / period_ms
    cause = cause or "cable, address, port or interface; is the robot on?"
    got, expected = f"{received} in {seconds:g} s", f"at least {wanted:.0f}"
    findings = [Finding("reports", got, expected, received >= wanted, cause)]
    if not reports:
        return findings
    last = reports[-1]
    numbers = np.array([[*r.q, *r.dq, *r.quat_wxyz, *r.gyro, *r.accel] for r in reports])
    finite = bool(np.isfinite(numbers).all())
    got = "all finite" if finite else "not all finite"
    findings.append(Finding("numbers", got, "all finite", finite))
    if not finite:
        return findings
    findings += [_check_ticks(reports), _check_battery(last, config)]
    findings += _check_motors(last, robot)
    findings += [_check_angles(reports, robot), *_check_still(reports), *_check_gravity(reports)]
    return findings if hung else [*findings, _check_legs(last, robot)]


def refuse_failed(name: str, findings: Sequence[Finding]) -> None:
    """Name the first check that failed.

    Raises:
        CheckError: one did.
    """
    for what, got, expected, ok, cause in findings:
        if not ok:
            raise CheckError(f"robot {name}: {what}", got, expected, cause)


def _at_most(name: str, got: str, value: float, most: float, unit: str, cause: str) -> Finding:
    return Finding(name, got, f"at most {most:g} {unit}", bool(value <= most), cause)


def _check_ticks(reports: Sequence[RobotReport]) -> Finding:
    count = len({report.tick for report in reports})
    got = f"{count} values in {len(reports)} reports"
    cause = "it repeats itself: its controller hangs"
    return Finding("its counter", got, "one that goes on", count > 0.9 * len(reports), cause)


def _check_battery(report: RobotReport, config: BridgeConfig) -> Finding:
    battery = report.battery
    charge = "unknown" if battery is None else f"{battery.charge} %"
    enough = battery is None or battery.charge >= config.battery_min
    return Finding("battery", charge, f"at least {config.battery_min} %", enough, "charge it")


def _check_motors(report: RobotReport, robot: RobotSpec) -> list[Finding]:
    off = [JOINT_NAMES[k] for k in np.flatnonzero(report.mode == PROTECTED)]
    limits = np.tile(robot.temperature_max, N_LEGS)
    hottest = int(np.argmax(report.temperature - limits))
    heat, limit = report.temperature[hottest], limits[hottest]
    cause, got = "switch the robot off and on again, let it cool", ", ".join(off) or "none"
    hot = f"{JOINT_NAMES[hottest]} {heat:.0f} °C"
    return [
        Finding("motors in protection mode", got, "none", not off, cause),
        _at_most("temperature", hot, heat, limit, "°C", "let it cool"),
    ]


def _check_angles(reports: Sequence[RobotReport], robot: RobotSpec) -> Finding:
    """Thighs and calves have ranges of their own, so that another order or sign is seen here."""
    q = np.array([report.q for report in reports])
    low, high = np.array(robot.lower) - _BEYOND, np.array(robot.upper) + _BEYOND
    outside = np.flatnonzero(((q < low) | (q > high)).any(axis=0))
    found = ", ".join(f"{JOINT_NAMES[k]} {q[-1, k]:.2f} rad" for k in outside) or "all within"
    expected = f"the joints of the {robot.title}"
    cause = "another kind of robot, or a joint whose zero is wrong: calibrate it"
    return Finding("joint angles", found, expected, not len(outside), cause)


def _check_still(reports: Sequence[RobotReport]) -> list[Finding]:
    gyro = max(float(np.linalg.norm(report.gyro)) for report in reports)
    rates = np.array([np.abs(report.dq) for report in reports]).mean(axis=0)
    fastest = int(np.argmax(rates))
    got = f"{JOINT_NAMES[fastest]} {rates[fastest]:.2f} rad/s"
    cause = "its own controller still moves it, or it is being moved"
    return [
        _at_most("gyro", f"{gyro:.2f} rad/s", gyro, _STILL_GYRO, "rad/s", "let it lie still"),
        _at_most("joint rates", got, rates[fastest], _STILL_JOINT, "rad/s", cause),
    ]


def _check_gravity(reports: Sequence[RobotReport]) -> list[Finding]:
    """It lies on its feet; specific force is g, upwards by the attitude too."""
    accel = np.mean([report.accel for report in reports], axis=0)
    size = float(np.linalg.norm(accel))
    quat = reports[-1].quat_wxyz
    tilt = tilt_of(quat)
    w, x, y, z = quat / max(float(np.linalg.norm(quat)), 1e-9)
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    cosine = float(up @ accel) / max(size, 1e-9)
    off = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    ok, expected = abs(size - GRAVITY) <= _GRAVITY_OFF, f"{GRAVITY:.1f} ± {_GRAVITY_OFF:g} m/s²"
    lay = "lay it on its feet on level ground"
    vertical = f"{off:.2f} rad off the accelerometer's vertical"
    axes = "the order of the quaternion, or the axes of the IMU"
    return [
        _at_most("posture", f"tilted by {tilt:.2f} rad", tilt, _FLAT, "rad", lay),
        Finding("accelerometer", f"{size:.1f} m/s²", expected, ok, "is it being moved?"),
        _at_most("attitude", vertical, off, _VERTICAL_OFF, "rad", axes),
    ]


def _check_legs(report: RobotReport, robot: RobotSpec) -> Finding:
    """What is lowest by the angles, the model and the attitude bears a robot that lies.

    A leg in another place, of another sign or with another zero would reach into the ground, and
    alone be lowest: then the centre of mass is not above what bears it.
    """
    places, heights = _lowest_points(report, robot)
    off = _outside(places[heights <= _TOUCHES])
    got = f"its centre of mass {off:.2f} m beside what is lowest"
    cause = "legs in another order, a sign or a zero that is wrong, or it is held"
    return _at_most("legs", got, off, _BESIDE, "m", cause)


def _lowest_points(report: RobotReport, robot: RobotSpec) -> tuple[Array, Array]:
    """Where the robot is lowest: feet, knees, hips and the corners of its trunk.

    Returns:
        Their places from the centre of mass, horizontally, (20, 2), and their heights over the
        lowest of them, (20,), m; world axes.
    """
    model = build_pinocchio_model(robot)
    data = model.createData()
    w, x, y, z = report.quat_wxyz / np.linalg.norm(report.quat_wxyz)
    q = np.array([0.0, 0.0, 0.0, x, y, z, w, *report.q])
    com = pinocchio.centerOfMass(model, data, q)
    pinocchio.updateFramePlacements(model, data)
    box = np.array(np.meshgrid(*([-half, half] for half in np.array(robot.trunk_box) / 2)))
    feet = [data.oMf[model.getFrameId(foot)].translation for foot in FOOT_FRAMES]
    points = [
        *(foot - [0.0, 0.0, robot.geometry.foot_radius] for foot in feet),
        *(data.oMi[k].translation - [0.0, 0.0, _LIMB_RADIUS] for k in range(4, 14, 3)),
        *(data.oMi[k].translation - [0.0, 0.0, _HIP_RADIUS] for k in range(3, 14, 3)),
        *(box.reshape(3, 8).T @ data.oMi[1].rotation.T),
    ]
    places = np.array(points) - com
    return places[:, :2], places[:, 2] - places[:, 2].min()


def _outside(places: Array) -> float:
    """How far the origin is outside of the hull of places, (n, 2), m; 0 within.

    It is the greatest distance of the origin to a line that has all places on its other side.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles)])
    return max(0.0, float((places @ directions).min(axis=0).max()))
