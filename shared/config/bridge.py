"""The section of bridges to real robots: where a robot is, and what it is protected from."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.key import key


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """How a bridge reaches its robot, and the limits that it keeps whatever an agent asks for."""

    endpoint: str = key(
        "", "-", "A1, Go1: where the robot is, HOST:PORT; empty: 192.168.123.10:8007"
    )
    listen: str = key(
        "",
        "-",
        "A1, Go1: where its packets arrive, HOST:PORT; empty: port 8080 (A1) or 8090 (Go1) of any "
        "address",
    )
    interface: str = key(
        "",
        "-",
        "Go2: network interface that it hangs on, such as eth0; {number} is that of the robot; "
        "lo: simulated ones",
    )
    domain: int = key(0, "1", "Go2: number of its DDS domain; on lo that of r1", low=0, high=200)
    period_ms: int = key(
        0,
        "ms",
        "between two states of the robot, and two commands; 0: 1 for A1 and Go1, 2 for Go2",
        low=0,
        high=2,
    )
    stop_buttons: str = key("L2+B", "-", "buttons of the remote control that stop the robot")
    torque_share: float = key(
        0.9, "1", "share of each motor's greatest torque that may be asked for", low=0.05, high=1.0
    )
    torque_rate: float = key(
        8.0, "N·m/ms", "how fast the torque asked for may change", low=0.1, high=100.0
    )
    speed_share: float = key(
        0.95,
        "1",
        "share of a joint's greatest speed beyond which it is too fast",
        low=0.1,
        high=1.5,
    )
    speed_ms: int = key(
        50, "ms", "for how long a joint may be too fast before the robot stops", low=0, high=100
    )
    power_max: float = key(
        900.0,
        "W",
        "mechanical power of all motors together that may be asked for",
        low=10.0,
        high=5000.0,
    )
    joint_margin: float = key(
        0.02, "rad", "how far from its end stops a joint is kept", low=0.0, high=0.3
    )
    tilt_max: float = key(
        0.9, "rad", "tilt of the trunk at which the robot stops", low=0.1, high=3.2
    )
    battery_min: int = key(
        20,
        "%",
        "charge below which a robot does not stand up; at half of it, it stops",
        low=0,
        high=100,
    )
    temperature_max: float = key(
        0.0,
        "°C",
        "temperature of a motor above which a robot does not stand up, and warns; 8 °C more stop "
        "it; 0: what this kind of robot has, by joint",
        low=0.0,
        high=120.0,
    )
    report_share: float = key(
        0.8,
        "1",
        "share of the packets of a second that must come before the robot is commanded",
        low=0.01,
        high=1.0,
    )
    report_max_ms: int = key(
        70, "ms", "age of the robot's last packet at which it stops", low=5, high=1000
    )
    hold_ms: int = key(
        20, "ms", "age of the agent's command from which on the joints are held", low=2, high=200
    )
    damp_ms: int = key(
        70,
        "ms",
        "age of the agent's command at which the robot stops; Linux may stop a bridge for 54 ms",
        low=4,
        high=1000,
    )
    passive_s: float = key(
        3.0,
        "s",
        "how long a robot that stops is damped before its motors are off",
        low=0.1,
        high=60.0,
    )
    stand_kp: float = key(
        80.0,
        "N·m/rad",
        "stiffness of the joints while the bridge moves the robot",
        low=1.0,
        high=300.0,
    )
    stand_kd: float = key(
        4.0,
        "N·m·s/rad",
        "damping of the joints while the bridge moves the robot",
        low=0.1,
        high=20.0,
    )
    stand_s: float = key(3.0, "s", "how long standing up takes, and lying down", low=1.0, high=30.0)
