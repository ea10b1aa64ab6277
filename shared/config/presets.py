"""Named settings of a section, the choices of its key `preset`: each replaces some defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

# Soft enough for planned forces to reach the robot through f_des, and for data that show it.
_SOFT: Final = {
    "gamma_defect": 1e5, "kp_z": 100.0, "kd_z": 20.0, "ki_z": 0.0, "kp_tilt": 400.0,
    "kd_tilt": 40.0, "kp_yaw": 50.0, "kd_yaw": 10.0,
}  # fmt: skip

# This project's choice of a low level as plain as the paper's may be, of which the paper gives the
# weights gamma alone: scheduled contacts, flat ground, a position reference of limited lead,
# moderate gains. Walks on flat ground; see `robust` for what keeps a team up elsewhere.
_PLAIN: Final = {
    "ki_z": 0.0, "kp_xy": 100.0, "kd_xy": 20.0, "ki_xy": 0.0,
    "kp_tilt": 400.0, "kd_tilt": 40.0, "contact_detection": False, "swing_height": 0.07,
    "load_time": 0.0, "reject_side_contacts": False, "reflex_ms": 0,
    "swing_delay": 0.0, "track_sinking_trunk": False, "flight": False, "slip_speed": 0.0,
    "foothold_inwards": 10.0, "contact_force": 8.0, "force_min": 2.0,
    "descent_speed": 0.5, "tilt_length": 1.0, "swing_weight": 1.0,
}  # fmt: skip

# What a motor would do without friction, inertia, delay or heat.
_IDEAL_MOTORS: Final = {
    "torque_speed": False, "friction": 0.0, "viscous_friction": 0.0, "rotor_inertia": False,
    "bandwidth": 0.0, "delay_ms": 0, "hard_stops": False, "heat_time": 0.0,
}  # fmt: skip

# Replans every 10 ms, and weighs more what feed-forward can still correct on a stiff low level.
# Peers' plans are held as long as with the usual rate. With these weights best responses of three
# robots would not converge undamped.
_FAST: Final = {
    "applied": 1, "latency_ms": 1, "Q": (1.2e7, 1e5, 6e5, 2.4e6, 2e6, 3e3),
    "max_peer_age": 12, "hold_steps": 20,
}  # fmt: skip

# The planner as the paper writes it: its Q and R, peers' plans not brought forward, forces and all
# planned outputs handed on to the whole-body QP, plans in effect at once; no bound on forces but
# the friction cone, no fading. The bound and the range stand for none: no plan reaches them.
_PAPER_PLANNER: Final = {
    "interface": "force", "tracked": "outputs", "latency_ms": 0, "compensation": False,
    "damping": 0.0, "Q": (1e6, 1e5, 1e5, 2e5, 1e5, 1e4), "R": (0.05, 0.05, 0.5),
    "deviation_max": (1e4, 1e4, 1e4), "trust_range": (1e6, 1e6, 1e6, 1e6),
}  # fmt: skip

# The pseudo-inverse of few data, all with noise on each foot's force for itself, and no gate on its
# best responses nor on its effects of peers: the paper has none.
_PAPER_FIT: Final = {
    "predictor": "pinv", "noise": (15.0, 15.0, 35.0), "wrench_noise": (0.0,) * 5,
    "disturbed": 0.0, "max_radius": 10.0, "max_peers_harm": 1000.0,
}  # fmt: skip

# Sensors that only make noise, and feet that measure N: for comparison with what is older.
_IDEAL: Final = {
    "joint_offset": 0.0, "orientation_bias": 0.0, "yaw_drift": 0.0, "foot_sensor": "newtons",
    "foot_force": 1.0, "accel_bias": 0.02,
}  # fmt: skip

PRESETS: Final[Mapping[str, Mapping[str, Mapping[str, Any]]]] = {
    "controller": {"robust": {}, "soft": _SOFT, "plain": _PLAIN},
    "motors": {"realistic": {}, "ideal": _IDEAL_MOTORS},
    "planner": {"usual": {}, "fast": _FAST, "paper": _PAPER_PLANNER},
    "identification": {"usual": {}, "paper": _PAPER_FIT},
    "sensors": {"realistic": {}, "ideal": _IDEAL},
}


def preset_keys(section: str) -> frozenset[str]:
    """Keys of a section that its presets set; a preset given later replaces them."""
    return frozenset(key for preset in PRESETS[section].values() for key in preset)
