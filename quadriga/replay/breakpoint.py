"""Stop a replay in the debugger, with all that the agent knows in scope."""

from __future__ import annotations

from collections.abc import Mapping

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.replay.comparison import Comparison
from quadriga.shared.messages import Message


class Breakpoint:
    """A stop before the first step from a tick on.

    Attributes:
        option: what the user asked for it with.
        tick: the tick.
        reached: whether the replay has come to it.
        files: what it has written: nothing.
    """

    option = "--break"
    files = ()

    def __init__(self, tick: int) -> None:
        self.tick = tick
        self.reached = False

    def before_step(
        self, agent: Agent, memory: AgentState, inputs: Inputs, comparison: Comparison
    ) -> None:
        """Stop if this is the step.

        Raises:
            bdb.BdbQuit: the user has left the debugger.
        """
        tick = inputs.state.tick
        if not self.reached and tick >= self.tick:
            self.reached = True
            stop_here(agent, memory, inputs, comparison.recorded_messages(tick))


def stop_here(
    agent: Agent, memory: AgentState, inputs: Inputs, recorded: Mapping[str, Message]
) -> None:
    """Hand over to pdb before a step.

    Args:
        agent: the agent.
        memory: what it remembers.
        inputs: what it takes in.
        recorded: what it sent then, by topic.

    Raises:
        bdb.BdbQuit: the user has left the debugger.
    """
    print(
        f"before the step of {agent.robot} at tick {inputs.state.tick}; in scope: agent, memory, "
        "inputs, recorded\n"
        "try: new, outputs = agent.step(memory, inputs); c goes on, q leaves"
    )
    breakpoint()
    return  # the debugger stops here, in the frame that holds all of it
