"""Stop a replay in the debugger, with all that the agent knows in scope."""

from __future__ import annotations

from collections.abc import Mapping

from quadriga.agents.agent import Agent, AgentState, Inputs
from quadriga.shared.wire.messages import Message


def stop_here(
    agent: Agent, memory: AgentState, inputs: Inputs, recorded: Mapping[str, Message]
) -> None:
    """Hand over to pdb before a step.

    Args:
        agent: the agent.
        memory: what it remembers.
        inputs: what it takes in.
        recorded: what it said then, by topic.

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
