"""One robot's agent, run again from what it took in, and held against what it sent then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from quadriga.progress import quiet_console
from quadriga.replay.difference import Difference
from quadriga.replay.outcome import format_outcome
from quadriga.replay.team_replay import replay


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """What came of a replay.

    Attributes:
        robot: its name.
        equal: whether every command, plan and measurement that was recorded is computed again to
            the byte, from inputs that were all recorded.
        difference: the first one, with its `tick`, the topic's `name`, the `field`, and the values
            `recorded` and `recomputed` as text; None if there is none.
        compared: how many messages are equal to the byte, by topic.
        missing: inputs that the recording lacks, with the tick of their step; after the first of
            them nothing could be compared.
        files: the planner's or the whole-body QP at the first difference, beside the recording.
        text: what `quadriga replay` says of it.
    """

    robot: str
    equal: bool
    difference: Difference | None
    compared: Mapping[str, int]
    missing: tuple[tuple[int, str], ...]
    files: tuple[Path, ...]
    text: str

    def __str__(self) -> str:
        """The text."""
        return self.text


def replay_robot(path: Path, robot: str) -> ReplayResult:
    """Replay one robot of a recording.

    Raises:
        RecordingError: the recording lacks what a replay needs.
        PredictorError: the predictor that the team walked with is not to be found.
    """
    with threadpool_limits():  # BLAS has the caller's number of threads after it
        (outcome,) = replay(path, (robot,), {}, None, None, quiet_console())
    verdict = outcome.verdict
    return ReplayResult(
        robot=robot,
        equal=verdict.exact,
        difference=verdict.first,
        compared=dict(verdict.equal),
        missing=tuple(verdict.missing),
        files=outcome.files,
        text=format_outcome(outcome),
    )
