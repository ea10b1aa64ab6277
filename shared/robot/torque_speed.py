"""How much torque a motor has at a speed."""

from __future__ import annotations

from quadriga.shared.runtime.jit import compiled


@compiled
def available_torque(peak: float, rate: float, corner: float, top: float) -> float:
    """Torque that a motor has along its own rotation, N·m; braking, it has its peak.

    Its voltage is limited: from the corner speed on, torque falls linearly, to zero at the top one.

    Args:
        peak: torque limit, N·m.
        rate: of the joint, rad/s.
        corner: corner speed, rad/s; infinite for a motor whose torque does not fall.
        top: top speed, rad/s.
    """
    speed = abs(rate)
    if speed <= corner:
        return peak
    return peak * max(0.0, top - speed) / (top - corner)
