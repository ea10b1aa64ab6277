"""Save the QPs of one moment of a replay: the whole-body QP and the planner's."""

from __future__ import annotations

from pathlib import Path

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.replay.comparison import Comparison
from quadriga.replay.saved_qp import PLANNER, WHOLE_BODY, problems_of, save


class ProblemSaver:
    """What saves the whole-body QP of the first step from a tick on, and the next planner's QP.

    Attributes:
        option: what the user asked for it with.
        tick: the tick.
        reached: whether the replay has come to it.
        files: what has been written.
    """

    option = "--save-qp"

    def __init__(self, tick: int, folder: Path) -> None:
        self.tick = tick
        self.reached = False
        self.files: tuple[Path, ...] = ()
        self._folder = folder
        self._wanted = {WHOLE_BODY, PLANNER}

    def before_step(
        self, agent: Agent, memory: AgentState, inputs: Inputs, _comparison: Comparison
    ) -> None:
        """Save what is wanted still, if this step solves it.

        Raises:
            RecordingError: a file cannot be written.
        """
        tick = inputs.state.tick
        if tick < self.tick or not self._wanted:
            return
        self.reached = True
        problems = problems_of(agent, memory, inputs, f"{agent.robot} at tick {tick}")
        for kind in sorted(self._wanted & problems.keys()):
            path = self._folder / f"replay-{agent.robot}-{tick}-{kind}.npz"
            save(path, problems[kind])
            self.files += (path,)
            self._wanted.discard(kind)
