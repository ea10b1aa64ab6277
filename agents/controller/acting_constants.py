"""What the second half of a tick needs of the configuration and the robot, as one flat row."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.foot_targets import N_FEET_GAINS, FeetGains, feet_gains
from quadriga.agents.controller.friction import N_FRICTION_RULE, FrictionRule, friction_rule
from quadriga.agents.controller.maths.links import LINK_SIZE, N_LINKS
from quadriga.agents.controller.maths.rows import numbers, places
from quadriga.agents.controller.model import RigidBody
from quadriga.agents.controller.trunk_feedback import (
    N_TRUNK_GAINS,
    SingleRigidBody,
    TrunkGains,
    trunk_gains,
)
from quadriga.agents.controller.whole_body.problem import N_WEIGHTS, Weights
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.torque_speed import MotorCurves, motor_curves
from quadriga.shared.runtime.jit import compiled


class ActingConstants(NamedTuple):
    """The row, taken apart.

    Attributes:
        links: `link_table`, (13, 14), of the bare robot.
        body: the bare robot as one rigid body.
        trunk: gains of the trunk's feedback.
        feet: what feet are asked for.
        weights: of the whole-body QP.
        friction: how much friction to count on.
        motors: their torque-speed curves.
        weight: of the bare robot, N; nominal forces carry it.
        free_fall: whether a robot without contact is asked to fall freely.
    """

    links: Array
    body: SingleRigidBody
    trunk: TrunkGains
    feet: FeetGains
    weights: Weights
    friction: FrictionRule
    motors: MotorCurves
    weight: float
    free_fall: bool


class ConstantsLayout(NamedTuple):
    """Where the row keeps what, see `ActingConstants`; of the body mass, centre and inertia."""

    links: slice
    mass: int
    com: slice
    inertia_inverse: slice
    trunk: slice
    feet: slice
    weights: slice
    friction: slice
    motors: slice
    weight: int
    free_fall: int


_LAYOUT: Final = ConstantsLayout(
    **places(
        links=N_LINKS * LINK_SIZE,
        mass=1,
        com=3,
        inertia_inverse=3 * 3,
        trunk=N_TRUNK_GAINS,
        feet=N_FEET_GAINS,
        weights=N_WEIGHTS,
        friction=N_FRICTION_RULE,
        motors=4 * N_JOINTS,
        weight=1,
        free_fall=1,
    )
)


def acting_constants(config: Config, body: RigidBody, weights: Weights) -> Array:
    """The row of a configuration and a robot."""
    controller, robot = config.controller, config.robot
    return np.concatenate(
        [
            body.links.ravel(),
            [body.mass],
            body.com,
            body.inertia_inverse.ravel(),
            trunk_gains(config),
            feet_gains(config),
            weights,
            friction_rule(controller),
            *motor_curves(robot, torque_speed=config.motors.torque_speed),
            [robot.weight, float(controller.flight)],
        ]
    )


@compiled
def unpack_constants(row: Array) -> ActingConstants:
    """The row, taken apart; arrays are views."""
    body = SingleRigidBody(
        row[_LAYOUT.mass], row[_LAYOUT.com], row[_LAYOUT.inertia_inverse].reshape(3, 3)
    )
    motors = row[_LAYOUT.motors].reshape(4, N_JOINTS)
    return ActingConstants(
        row[_LAYOUT.links].reshape(N_LINKS, LINK_SIZE),
        body,
        TrunkGains(*numbers(row[_LAYOUT.trunk], N_TRUNK_GAINS)),
        FeetGains(*numbers(row[_LAYOUT.feet], N_FEET_GAINS)),
        Weights(*numbers(row[_LAYOUT.weights], N_WEIGHTS)),
        FrictionRule(*numbers(row[_LAYOUT.friction], N_FRICTION_RULE)),
        MotorCurves(motors[0], motors[1], motors[2], motors[3]),
        row[_LAYOUT.weight],
        row[_LAYOUT.free_fall] > 0.5,
    )
