"""A recorded walk: its configuration, what came of it, and every message as arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadriga.api.topic_arrays import TopicArrays
from quadriga.api.topic_reader import find_key, read_topic
from quadriga.api.tracking_arrays import TrackingArrays, read_tracking
from quadriga.recordings.events import read_events
from quadriga.recordings.readable import recording_of
from quadriga.recordings.summary import kept_summary, summary_of
from quadriga.recordings.traces import read_traces
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError, did_you_mean
from quadriga.shared.messages import Event
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names

if TYPE_CHECKING:  # what draws, replays and predicts is imported by who asks for it
    from quadriga.agents.predictor.predictor import Predictor
    from quadriga.api.replayed import ReplayResult
    from quadriga.report.troubles import Trouble


class Run:
    """A recorded walk, of `quadriga.walk` or `quadriga.open`.

    What is asked for is read then, and kept: of a long recording only that is decoded.

    Example:
        >>> state = run["r1/state"]
        >>> print(run.summary["fallen"], state["q_joint"].shape)

    Attributes:
        path: the recording.
        folder: where it lies, with the logs, the report and the predictor of the walk.
        complete: whether the recording was finished; a cut one is read up to the cut.
    """

    def __init__(self, path: Path) -> None:
        """Open a recording.

        Raises:
            RecordingError: there is none, or it is empty or foreign.
        """
        self._recording = Recording(path)
        self._read: dict[str, TopicArrays] = {}
        self.path = path
        self.folder = path.parent
        self.complete = self._recording.complete

    @cached_property
    def config(self) -> Config:
        """The configuration that was walked, such as `run.config.team.robots`.

        Raises:
            RecordingError: the recording has none, or one of another version.
        """
        return recorded_config(self._recording)

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots, r1 … rn."""
        return robot_names(self.config.team.robots)

    @cached_property
    def summary(self) -> Mapping[str, Any]:
        """The figures of the walk, as its summary.json has them: m, m/s, rad, s; times in ms, µs.

        `fell` and `fallen`, `distance`, `mean_vx`, `rmse` by output, `planner_ms_median` and
        `planner_ms_p99` (without each process's first plan), `counters` of each robot, `gaps` ….
        They are computed if the walk has left none, which reads the whole recording.

        Raises:
            RecordingError: the recording holds no message.
        """
        kept = kept_summary(self._recording)
        return summary_of(read_traces(self._recording)) if kept is None else kept

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """What happened, in order of time, such as pushes, faults, falls and the end.

        Each has a `tick` [ms], a `kind`, a `code`, the `robot` that it is about, or "", and a
        `detail` in words.

        Example:
            >>> for event in run.events:
            ...     print(event.tick, event.robot, event.detail)
        """
        return read_events(self._recording, self.robots)

    @cached_property
    def topics(self) -> Mapping[str, int]:
        """How many messages there are of each key, without the name of the team in it."""
        counts = Counter(entry.key for entry in self._recording.entries())
        own = f"{self.config.team.name}/"
        return {key.removeprefix(own): counts[key] for key in sorted(counts)}

    @cached_property
    def troubles(self) -> tuple[Trouble, ...]:
        """Falls, faults and stops, each with what was out of the ordinary in the second before it.

        Each has a `tick` [ms], the `robots` that it concerns, those that fell first, and its
        `signs` by time: their `tick` [ms], the `robot`, a `text`. The page of the walk shows the
        same. The whole recording is read.

        Example:
            >>> for trouble in run.troubles:
            ...     print(trouble.tick, trouble.robots, [sign.text for sign in trouble.signs])

        Raises:
            RecordingError: the recording holds no message.
        """
        from quadriga.report.run import read_run
        from quadriga.report.troubles import find_troubles

        return tuple(find_troubles(read_run(self.path)))

    def __getitem__(self, key: str) -> TopicArrays:
        """Every message of a key as arrays.

        Example:
            >>> plans = run["r1/plan"]
            >>> print(plans["u"].shape, plans.fields["u"].unit)
            (250, 25, 12) N

        Args:
            key: one of `topics`; one of the table of topics that nobody spoke on has no message.

        Raises:
            RecordingError: there is no such key, or its messages are not of this project.
        """
        if key not in self._read:
            full, topic, robot = find_key(self.config, key)
            spoken = full.removeprefix(f"{self.config.team.name}/") in self.topics
            if topic is None or not (spoken or robot in ("", *self.robots)):
                raise RecordingError(
                    f"a key of {self.path}",
                    repr(key),
                    "one of a known topic",
                    did_you_mean(key, self.topics) or "`topics` has those that were recorded",
                )
            self._read[key] = read_topic(self._recording, self.config, full, topic)
        return self._read[key]

    def tracking(self, robot: str) -> TrackingArrays:
        """What a robot's trunk was measured, commanded and planned to do, on one time grid.

        Example:
            >>> tracking = run.tracking("r1")
            >>> rmse = (tracking.error[100:] ** 2).mean(axis=0) ** 0.5

        Args:
            robot: its name.

        Returns:
            T samples, one every 10 ms: `tick` (T,), ms, and of each the six outputs z, vx, vy,
            roll, pitch, wz, (T, 6), in m, m/s, rad, rad/s.

        Raises:
            RecordingError: there is no such robot, or it sent nothing.
        """
        return read_tracking(self._recording, self.config, self._index(robot))

    def predictor(self) -> Predictor:
        """The predictor that the team walked with.

        Its matrices are `G`, shape (phases, n, n, 6 N, width).

        Example:
            >>> run.predictor().G.shape

        Raises:
            PredictorError: its planner needs none, or it lies neither beside the recording nor in
                the cache.
        """
        from quadriga.replay.recorded_predictor import read_recorded

        return read_recorded(self._recording, self.config)

    def replay(self, robot: str) -> ReplayResult:
        """Run one robot's agent again from what it took in: is what it sends the same to the byte?

        Example:
            >>> result = run.replay("r2")
            >>> print(result.equal, result.difference)

        Args:
            robot: its name.

        Raises:
            RecordingError: there is no such robot, or the recording lacks what a replay needs.
            PredictorError: the predictor that the team walked with is not to be found.
        """
        from quadriga.api.replayed import replay_robot

        self._index(robot)
        return replay_robot(self.path, robot)

    def __repr__(self) -> str:
        """Where the recording is."""
        return f"Run({str(self.path)!r})"

    def _index(self, robot: str) -> int:
        """The place of a robot in the team.

        Raises:
            RecordingError: there is no such robot.
        """
        if robot not in self.robots:
            where = f"a robot of {self.path}"
            raise RecordingError(where, repr(robot), f"one of {', '.join(self.robots)}")
        return self.robots.index(robot)


def open(path: str | Path) -> Run:
    """A recorded walk.

    Nothing but its head is read yet, however long it is.

    Example:
        >>> run = quadriga.open("runs/20261126-101500")
        >>> print(run.topics, run.config.world.scenario)

    Args:
        path: a run folder, or a recording (`.mcap`).

    Raises:
        RecordingError: there is no recording, or it is empty or foreign.
    """
    return Run(recording_of(Path(path)))
