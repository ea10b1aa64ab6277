"""No planning at all: the robot walks on nominal forces and follows the operator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.agents.planning.interface import PlanningInputs, PlanningInterface, PlanningOutputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config

_NO_OUTPUTS: Final = PlanningOutputs()


class NominalPlanning(PlanningInterface[None]):
    """Plans nothing and remembers nothing."""

    def initial(self) -> None:
        """No state."""
        return

    def step(self, state: None, inputs: PlanningInputs) -> tuple[None, PlanningOutputs]:
        """No deviation from nominal forces."""
        return None, _NO_OUTPUTS


def build_nominal(
    _config: Config, _index: int, _predictor: Predictor | None, _clock_ns: Callable[[], int]
) -> NominalPlanning:
    """The planning part of the kind `none`."""
    return NominalPlanning()
