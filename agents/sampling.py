"""From 1 kHz ticks to the 100 Hz samples that planners and datasets use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controller.estimator import Estimate
from agents.controller.rotation import roll_pitch_yaw
from shared.jit import compiled
from shared.messages import Measurement
from shared.robot import Array

SAMPLE_MS = 10


@dataclass(frozen=True, slots=True)
class ForceMean:
    """Running mean of the forces over the present sample: sum (12,), N, and ticks counted."""

    total: Array
    count: int

    def add(self, force: Array) -> ForceMean:
        """Count one more tick."""
        return ForceMean(self.total + force, self.count + 1)

    def mean(self) -> Array:
        """Mean force so far, (12,), N; zero without ticks."""
        return self.total / max(1, self.count)


def no_force() -> ForceMean:
    """A mean over nothing."""
    return ForceMean(np.zeros(12), 0)


def measured(tick: int, forces: ForceMean, outputs: Array, stance: Array) -> Measurement:
    """The sample that ends at `tick`."""
    return Measurement(tick, tick * 1_000_000, forces.mean(), outputs, stance)


def outputs_of(estimate: Estimate, ground: float) -> Array:
    """The outputs y of an estimate: z over the ground, vx, vy, roll, pitch, wz. Shape (6,)."""
    return _outputs(estimate.position, estimate.velocity, estimate.R, estimate.omega, ground)


@compiled
def _outputs(position: Array, velocity: Array, R: Array, omega: Array, ground: float) -> Array:
    rpy = roll_pitch_yaw(R)
    c, s = np.cos(rpy[2]), np.sin(rpy[2])
    return np.array(
        [
            position[2] - ground,
            c * velocity[0] + s * velocity[1],
            -s * velocity[0] + c * velocity[1],
            rpy[0],
            rpy[1],
            R[2, 0] * omega[0] + R[2, 1] * omega[1] + R[2, 2] * omega[2],
        ]
    )
