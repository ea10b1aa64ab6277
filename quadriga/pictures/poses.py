"""Where every body of the team was at some instants of a recorded run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import mujoco
import numpy as np

from quadriga.recordings.truth import Ticks
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.messages import State, Truth
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.topics import STATE, TRUTH
from quadriga.sim_server.world.layout import NQ
from quadriga.sim_server.world.team_model import TeamModel, build_team_model


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of the team at F instants.

    Attributes:
        config: the configuration of the run.
        tick: shape (F,), ms.
        qpos: MuJoCo positions of the whole team, shape (F, 19 n).
        grf: ground on foot, world frame, shape (F, n, 4, 3), N.
    """

    config: Config
    tick: Ticks
    qpos: Array
    grf: Array

    def centre(self) -> Array:
        """Mean position of the trunks, shape (F, 3), m."""
        centre: Array = self.qpos.reshape(len(self.tick), -1, NQ)[:, :, :3].mean(axis=1)
        return centre

    def radius(self) -> float:
        """Radius of a circle around the centre that holds the team at all instants, m."""
        places = self.qpos.reshape(len(self.tick), -1, NQ)[:, :, :3]
        return (
            float(np.linalg.norm(places - self.centre()[:, None], axis=-1).max(initial=0.0)) + 0.4
        )


def truth_ticks(recording: Recording) -> Ticks:
    """Ticks at which the truth was recorded, in ascending order, ms.

    Raises:
        RecordingError: there are none.
    """
    ticks = {truth.tick for truth in _truths(recording)}
    if not ticks:
        raise RecordingError(
            str(recording.path),
            "a recording without sim/truth",
            "one of a simulated walk",
            "nobody else knows where the trunks were",
        )
    return np.array(sorted(ticks), dtype=np.int64)


def read_poses(recording: Recording, ticks: Ticks) -> Poses:
    """Poses at `ticks`, which must be some of `truth_ticks`.

    Raises:
        RecordingError: truth or joint angles are missing at one of them.
    """
    config = recorded_config(recording)
    names = robot_names(config.team.robots)
    row = {tick: i for i, tick in enumerate(ticks.tolist())}
    qpos = np.full((len(ticks), len(names), NQ), np.nan)
    grf = np.zeros((len(ticks), len(names), 4, 3))
    robot_of = {STATE.key(config.team.name, name): i for i, name in enumerate(names)}
    for truth in _truths(recording):
        at = row.get(truth.tick)
        if at is not None:
            qpos[at, :, :3], qpos[at, :, 3:7] = truth.base_pos, truth.base_quat_wxyz
            grf[at] = truth.grf
    for key, tick, _, payload in recording.entries({STATE.name}):
        at = row.get(tick)
        if at is not None and key in robot_of:
            with suppress(MessageError):  # as if it had been lost
                qpos[at, robot_of[key], 7:] = decode(payload, State).q_joint
    if np.isnan(qpos[..., :7]).any():
        raise RecordingError(str(recording.path), "instants without sim/truth", "truth every 10 ms")
    # A robot whose state was lost at an instant is shown standing.
    qpos[..., 7:] = np.where(np.isnan(qpos[..., 7:]), config.robot.q_stand, qpos[..., 7:])
    return Poses(config, ticks, qpos.reshape(len(ticks), -1), grf)


def _truths(recording: Recording) -> Iterator[Truth]:
    """Every valid truth about the team of the recording; anybody may have published others."""
    names = robot_names(recorded_config(recording).team.robots)
    for entry in recording.entries({TRUTH.name}):
        with suppress(MessageError):
            truth = decode(entry.payload, Truth)
            if truth.robots == names and len(truth.base_pos) == len(names):
                yield truth


class PosedTeam:
    """The team's model, to be put into recorded poses.

    Args:
        config: of the run.
        dress: gets the world before it is compiled, to change what pictures of it show.
    """

    def __init__(
        self, config: Config, dress: Callable[[mujoco.MjSpec], None] | None = None
    ) -> None:
        self.config = config
        self.team: TeamModel = build_team_model(config, dress)
        self.model = self.team.model
        self.physics = mujoco.MjData(self.model)
        self.names = robot_names(config.team.robots)

    def set(self, qpos: Array) -> None:
        """Put all bodies where positions (19 n,) have them; loose stones have none recorded."""
        self.physics.qpos[: len(qpos)] = qpos
        mujoco.mj_forward(self.model, self.physics)

    def trunks(self) -> Array:
        """Positions of all trunks, shape (n, 3), m, world frame."""
        return np.array([self.physics.body(f"{name}/trunk").xpos for name in self.names])

    def feet(self) -> Array:
        """Positions of all feet, shape (n, 4, 3), m, world frame."""
        return self._places("{leg}_foot")

    def legs(self) -> Array:
        """Hip, thigh, calf and foot of all legs, shape (n, 4, 4, 3), m, world frame."""
        parts = ("hip", "thigh", "calf", "foot")
        return np.stack([self._places(f"{{leg}}_{part}") for part in parts], axis=2)

    def _places(self, body: str) -> Array:
        legs: Sequence[str] = ("FL", "FR", "RL", "RR")
        positions = [
            [self.physics.body(f"{name}/{body.format(leg=leg)}").xpos for leg in legs]
            for name in self.names
        ]
        return np.array(positions)
