"""Keys of the configuration that came later than hashes which are still compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, Final

from quadriga.shared.config.bridge import BridgeConfig
from quadriga.shared.config.renamed import with_first_names

# By today's name, `section.key`: the value that all that is older was made with. While a key has
# it, nothing that is hashed tells that there is such a key.
LATER_KEYS: Final[Mapping[str, Any]] = MappingProxyType(
    {
        "team.robot": "a1",
        "team.plant": "mujoco",
        "team.plants": "one",
        "team.auto_resume": False,
        "team.resume_after": 1.0,
        "team.controller": "",
        "bus.clock_timeout": 0.5,
        "bus.reconnect_timeout": 30.0,
        "bus.certificates": "certs",
        "bus.plaintext": False,
        "runtime.refuse_overload": True,
        "planner.options": "",
        "planner.cost": "own",
        "planner.tracked": "speeds",
        "identification.preset": "usual",
        "identification.wrench_noise": (0.0, 0.0, 0.0, 0.0, 0.0),
        "identification.disturbed": 0.0,
        "identification.max_peers_harm": 1000.0,
        "identification.response": "",
        "world.spawn": "standing",
        "world.stairs_rise": 0.06,
        "world.stairs_run": 0.3,
        "world.stairs_count": 8,
        "world.leg_collisions": False,
        "world.friction_of": "",
        "world.faults": "",
        "world.live_faults": False,
        "world.lost_command": "damp",
        "reference.driver": "configured",
        "reference.page_port": 0,
        "motors.preset": "ideal",
        "motors.torque_speed": False,
        "motors.friction": 0.0,
        "motors.viscous_friction": 0.0,
        "motors.rotor_inertia": False,
        "motors.bandwidth": 0.0,
        "motors.delay_ms": 0,
        "motors.hard_stops": False,
        "motors.heat_time": 0.0,
        "sensors.preset": "ideal",
        "sensors.joint_offset": 0.0,
        "sensors.orientation_bias": 0.0,
        "sensors.yaw_drift": 0.0,
        "sensors.foot_sensor": "newtons",
        "sensors.foot_scale": 1.5,
        "sensors.foot_scale_spread": 0.5,
        "sensors.foot_offset": 0.0,
        "sensors.foot_bias": 30.0,
        "sensors.foot_drift": 3.0,
        "sensors.foot_refresh_rate": 1000.0,
        "sensors.foot_dropout_rate": 0.05,
        "sensors.foot_dropout_ms": 200.0,
        "estimator.tilt_time": 0.0,
        "controller.mu_slippery": 2.0,
        "controller.foothold_inwards": 10.0,
        "controller.foot_load": "sensor",
        "controller.contact_torque_force": 12.0,
        "controller.reaction_filter_ms": 3.0,
        "controller.calibration_time": 3.0,
        **{f"bridge.{item.name}": item.default for item in fields(BridgeConfig)},
    }
)
# Of these, today's default changes no walk but such in which something fails: like the first value
# it is left out of what is hashed.
_UNSEEN: Final[Mapping[str, Any]] = MappingProxyType({"world.lost_command": "lower"})


def hashed_sections(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key as they are hashed and compared across versions.

    A key that came later is left out while it has its value of `LATER_KEYS`, and a section of which
    no key is left; all others stand under the names that they had first. So neither a new key nor a
    new name alone changes a hash.

    Args:
        sections: values by section and key under today's names, as `asdict` gives them.
    """
    left = {section: _leave_out(section, keys) for section, keys in sections.items()}
    return with_first_names(
        {section: keys for section, keys in left.items() if keys != {} or not sections[section]}
    )


def with_older_values(sections: Mapping[str, Any]) -> dict[str, Any]:
    """What another version wrote down in full, with the keys that it did not know yet.

    They have the value that all that is older was made with, not today's default.

    Args:
        sections: values by section and key under today's names.
    """
    filled = dict(sections)
    for name, value in LATER_KEYS.items():
        section, _, key = name.partition(".")
        keys = filled.get(section, {})
        if isinstance(keys, dict):
            filled[section] = {key: value, **keys}
    return filled


def _leave_out(section: str, keys: Any) -> Any:
    if not isinstance(keys, dict):
        return keys
    return {key: value for key, value in keys.items() if not _is_as_before(section, key, value)}


def _is_as_before(section: str, key: str, value: Any) -> bool:
    name = f"{section}.{key}"
    if name not in LATER_KEYS:
        return False
    return bool(value == LATER_KEYS[name] or value == _UNSEEN.get(name, LATER_KEYS[name]))
