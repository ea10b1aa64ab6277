"""What came of one robot's replay, in memory and as text."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from quadriga.agents.inbox import list_messages
from quadriga.replay.comparison import COMPARED, ReplayedStep, ReplayVerdict

_STATEFUL: Final = (
    "the planner keeps state outside of what its `step` returns: before this, an agent built anew "
    "went on with all that the first one remembered; one agent alone comes out equal"
)
_SHOWN: Final = 3  # messages missing from the recording that are named


@dataclass(frozen=True, slots=True)
class ReplayOutcome:
    """What came of one robot's replay.

    Attributes:
        robot: its name.
        verdict: what is equal and what is not.
        changed: what was changed, empty for a plain replay.
        seconds: world time replayed, s.
        wall: time that reading and replaying took, s.
        inputs: what the agent took in at the first difference, in short.
        files: what was left behind: the figure of a change, the problem at a difference.
        stateful: whether all would be equal up to there, had one agent made the whole replay.
    """

    robot: str
    verdict: ReplayVerdict
    changed: str
    seconds: float
    wall: float
    inputs: str = ""
    files: tuple[Path, ...] = ()
    stateful: bool = False

    @property
    def failed(self) -> bool:
        """Whether what should be equal is not."""
        return not self.changed and not self.verdict.exact


def format_inputs(step: ReplayedStep) -> str:
    """What a step took in: serials of each source."""
    by_source: dict[str, list[str]] = defaultdict(list)
    for (topic, sender), (first, second) in list_messages(step.inputs):
        by_source[f"{topic} of {sender}"].append(f"{first}.{second}" if second else str(first))
    state = step.inputs.state
    passed = state.tick - step.before.tick - 1
    parts = [f"state of tick {state.tick}" + (f" ({passed} passed over)" if passed else "")]
    parts += [f"{source}: {', '.join(serials)}" for source, serials in by_source.items()]
    return "; ".join([*parts, f"mode {step.before.mode.name}"])


def format_outcome(outcome: ReplayOutcome) -> str:
    """One line for a robot, more where something differs."""
    lines = [f"{outcome.robot}: {_format_counts(outcome)}; {_format_pace(outcome)}"]
    verdict = outcome.verdict
    if outcome.changed:
        lines.append(f"  changed: {outcome.changed}")
    if verdict.first is not None:
        lines.append(f"  first difference: {verdict.first}")
        if outcome.stateful:
            lines.append(f"  {_STATEFUL}")
        if outcome.inputs:
            lines.append(f"  inputs there: {outcome.inputs}")
    if verdict.missing:
        named = "; ".join(f"{name} (tick {tick})" for tick, name in verdict.missing[:_SHOWN])
        more = len(verdict.missing) - _SHOWN
        rest = f" and {more} more" if more > 0 else ""
        lines.append(f"  input missing from the recording: {named}{rest}")
        if not outcome.changed:
            lines.append(f"  nothing after tick {verdict.last} can be compared")
    lines += [f"  {_name_file(file.suffix)}: {file}" for file in outcome.files]
    return "\n".join(lines)


def _format_counts(outcome: ReplayOutcome) -> str:
    """What differs, what is equal, what the recorder lost."""
    verdict, names = outcome.verdict, [topic.name for topic in reversed(COMPARED)]
    differing = []
    for name in names:
        count = verdict.differing[name]
        if count:
            differing.append(f"{count} of {_format_count(verdict.equal[name] + count, name)}")
    equal = [
        _format_count(verdict.equal[name], name)
        for name in names
        if verdict.equal[name] and not verdict.differing[name]
    ]
    lost = [
        _format_count(verdict.unrecorded[name], name) for name in names if verdict.unrecorded[name]
    ]
    untold = [_format_count(verdict.untold[name], name) for name in names if verdict.untold[name]]
    parts = (
        (differing, "differ"),
        (equal, "equal to the byte"),
        (lost, "not in the recording"),
        (untold, "of a process that was killed before it told what it had taken in"),
    )
    return "; ".join(f"{', '.join(names)} {what}" for names, what in parts if names) or "nothing"


def _format_count(count: int, name: str) -> str:
    return f"{count} {name}{'' if count == 1 else 's'}"


def _format_pace(outcome: ReplayOutcome) -> str:
    factor = outcome.seconds / max(outcome.wall, 1e-9)
    return f"{outcome.seconds:.1f} s in {outcome.wall:.1f} s, {factor:.1f} × real time"


def _name_file(suffix: str) -> str:
    return (
        "figure" if suffix == ".png" else "the QP of that step (python -m quadriga.replay.saved_qp)"
    )
