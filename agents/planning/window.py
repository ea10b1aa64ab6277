"""The window of a robot's own samples that a plan is made of."""

from __future__ import annotations

import numpy as np

from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planning.operator_references import base_of_window, reference_at
from quadriga.agents.predictor.episode import commanded_outputs, output_base
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Reference
from quadriga.shared.topics import SAMPLE_MS


def is_gapless(samples: tuple[Measurement, ...], count: int, end: int) -> bool:
    """Whether the last `count` samples up to the tick `end` are there."""
    return len(samples) >= count and samples[-count].tick == end - SAMPLE_MS * (count - 1)


def build_planner_inputs(
    config: Config,
    step: int,
    end: int,
    samples: tuple[Measurement, ...],
    references: tuple[Reference, ...],
) -> PlannerInputs:
    """What a planning step consumes of a robot itself.

    Args:
        config: the team's configuration.
        step: planning step.
        end: its tick, at which the last sample ends.
        samples: of the robot, at least the T_ini up to `end`.
        references: what the operator asked for lately.
    """
    planner, window = config.planner, samples[-config.planner.T_ini :]
    now, _ = reference_at(references, end, config.reference.height)
    return PlannerInputs(
        step=step,
        u_ini=np.array([sample.u for sample in window]),
        y_ini=np.array([sample.y for sample in window]),
        stance_ini=np.array([sample.stance for sample in window]) > 0.5,
        y_base_ini=base_of_window(config, end, references),
        y_base=np.repeat(output_base(config, now)[None], planner.N, axis=0),
        y_des=np.repeat(commanded_outputs(now)[None], planner.N, axis=0),
        weight=config.robot.weight,
    )
