"""Section of the simulated motors."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.key import key


@dataclass(frozen=True, slots=True)
class MotorsConfig:
    """Motors and joints: what the world simulates, and what of it the low level's model has."""

    preset: str = key(
        "realistic",
        "-",
        "realistic, or ideal (a motor gives at once what is commanded, within one limit): replaces "
        "the defaults below",
        choices=("realistic", "ideal"),
    )
    torque_speed: bool = key(
        True,
        "-",
        "a motor's torque falls with the joint's speed, to zero at the joint's speed limit",
    )
    friction: float = key(
        0.4,
        "N·m",
        "dry friction of each joint, motor and gear; with friction rotor_inertia must be true",
        low=0.0,
        high=0.8,
    )
    viscous_friction: float = key(
        0.04, "N·m·s/rad", "friction of each joint that grows with its rate", low=0.0, high=1.0
    )
    rotor_inertia: bool = key(
        True, "-", "the rotors' inertia, as the joints feel it behind their gears"
    )
    bandwidth: float = key(
        100.0,
        "Hz",
        "a motor's torque follows the commanded one as a first-order lag of this corner "
        "frequency; 0: at once",
        low=0.0,
        high=1e4,
    )
    delay_ms: int = key(2, "ms", "time from a command until the motors act on it", low=0, high=50)
    hard_stops: bool = key(
        True, "-", "a joint's end stops give way by hardly anything; false: by some hundredths"
    )
    heat_time: float = key(
        300.0,
        "s",
        "thermal time constant of a motor; hot ones give no more than their continuous torque; "
        "0: motors do not heat up",
        low=0.0,
        high=1e5,
    )
