"""A controller of one's own as a plain function: `serve(step)` does the rest.

    from quadriga.controller import build_command, serve

    def step(state, reference):
        return build_command(state, q_des=[0.0, 0.8, -1.6] * 4, kp=80.0, kd=3.0)

    serve(step)

See docs/tutorials/own_controller.md, also for programs in other languages.
"""

from quadriga.controller.serve import ControllerTask, read_task, serve
from quadriga.controller.stepped import build_command
from quadriga.shared.messages import Command, Reference, State

__all__ = ["Command", "ControllerTask", "Reference", "State", "build_command", "read_task", "serve"]
