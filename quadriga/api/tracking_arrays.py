"""What a robot's trunk was asked, planned and measured to do, on one time grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from quadriga.api.frames import build_frame
from quadriga.recordings.traces import demanded_outputs, read_traces
from quadriga.recordings.tracking import track_outputs
from quadriga.shared.config.sections import Config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import OUTPUTS, robot_names
from quadriga.shared.topics import MEASUREMENT, PLAN, REFERENCE, TRUTH

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, slots=True, eq=False)
class TrackingArrays:
    """Outputs z, vx, vy, roll, pitch, wz of one robot at the T ticks of its measurements.

    Speeds are in the robot's yaw frame. Measured and planned heights are those over the feet that
    stand, the true one is that over the terrain under the hips. Where something is not known, all
    six are NaN: before anything was asked for, without a plan, without the simulator's truth.

    Example:
        >>> tracking = run.tracking("r1")
        >>> rmse = (tracking.error[100:] ** 2).mean(axis=0) ** 0.5

    Attributes:
        robot: its name.
        tick: shape (T,), ms; every 10 ms.
        measured: by the robot's own estimator, shape (T, 6).
        commanded: by the reference in force, shape (T, 6); roll and pitch are 0.
        planned: for this tick by the plan in force, shape (T, 6).
        truth: by the simulator, which no robot knows, shape (T, 6).
        outputs: names of the six.
        units: of the six.
    """

    robot: str
    tick: NDArray[np.int64]
    measured: NDArray[np.float64]
    commanded: NDArray[np.float64]
    planned: NDArray[np.float64]
    truth: NDArray[np.float64]
    outputs: ClassVar[tuple[str, ...]] = OUTPUTS
    units: ClassVar[tuple[str, ...]] = ("m", "m/s", "m/s", "rad", "rad", "rad/s")

    @property
    def time(self) -> NDArray[np.float64]:
        """World time, shape (T,), s."""
        return self.tick / 1000.0

    @property
    def error(self) -> NDArray[np.float64]:
        """The tracking error: measured less commanded, shape (T, 6)."""
        return self.measured - self.commanded

    def frame(self) -> DataFrame:
        """All of it as a table, columns `measured.vx`, `commanded.vx`, `planned.vx`, `truth.vx` ….

        Example:
            >>> table = run.tracking("r1").frame()
            >>> table[["measured.vx", "commanded.vx"]].plot()

        Returns:
            A pandas.DataFrame whose index is `tick` [ms].

        Raises:
            ConfigError: pandas is not installed; the extra `frame` has it.
        """
        columns = {
            f"{what}.{name}": getattr(self, what)[:, i]
            for what in ("measured", "commanded", "planned", "truth")
            for i, name in enumerate(OUTPUTS)
        }
        return build_frame(columns, {"tick": self.tick})


def read_tracking(recording: Recording, config: Config, index: int) -> TrackingArrays:
    """The tracking of the robot at `index`; nothing of the other robots is decoded.

    Raises:
        RecordingError: the recording holds no message of it.
    """
    team, robot = config.team.name, robot_names(config.team.robots)[index]
    keys = {topic.key(team, robot) for topic in (MEASUREMENT, PLAN)}
    keys |= {topic.key(team) for topic in (REFERENCE, TRUTH)}
    traces = read_traces(recording, keys=keys)
    tracked = track_outputs(traces, index)
    return TrackingArrays(
        robot=robot,
        tick=tracked.tick,
        measured=tracked.measured,
        commanded=demanded_outputs(traces, tracked.tick),
        planned=tracked.planned,
        truth=tracked.true,
    )
