"""No planning at all: the robot walks on nominal forces and follows the operator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.agents.planning.interface import NOTHING, Expected, PlanningInputs, PlanningOutputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config

_NO_OUTPUTS: Final = PlanningOutputs()


class NominalPlanning:
    """Plans nothing and remembers nothing."""

    @property
    def peers(self) -> tuple[str, ...]:
        """None."""
        return ()

    def initial(self) -> None:
        """No state."""
        return

    def expected(self, tick: int) -> Expected:
        """Nothing."""
        return NOTHING

    def step(self, state: None, inputs: PlanningInputs) -> tuple[None, PlanningOutputs]:
        """No deviation from nominal forces."""
        return None, _NO_OUTPUTS

    def problem_of(self, state: None, inputs: PlanningInputs) -> None:
        """No QP."""
        return


def build_nominal(
    _config: Config, _index: int, _predictor: Predictor | None, _clock_ns: Callable[[], int]
) -> NominalPlanning:
    """The planning part of the kind `none`."""
    return NominalPlanning()
