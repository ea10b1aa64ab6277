"""What a replay tells its user: one line for each robot, more where something differs."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final

from quadriga.agents.inbox.intake_log import taken_in
from quadriga.replay.rerun import COMPARED, Step

if TYPE_CHECKING:
    from quadriga.replay.run import ReplayOutcome

_SHOWN: Final = 3  # messages missing from the recording that are named


def in_short(step: Step) -> str:
    """What a step took in: serials of each source."""
    by_source: dict[str, list[str]] = defaultdict(list)
    for (topic, sender), (first, second) in taken_in(step.inputs):
        by_source[f"{topic} of {sender}"].append(f"{first}.{second}" if second else str(first))
    state = step.inputs.state
    passed = state.tick - step.before.tick - 1
    parts = [f"state of tick {state.tick}" + (f" ({passed} passed over)" if passed else "")]
    parts += [f"{source}: {', '.join(serials)}" for source, serials in by_source.items()]
    return "; ".join([*parts, f"mode {step.before.mode.name}"])


def described(outcome: ReplayOutcome) -> str:
    """The lines about one robot."""
    lines = [f"{outcome.robot}: {_counts(outcome)}; {_pace(outcome)}"]
    verdict = outcome.verdict
    if outcome.changed:
        lines.append(f"  changed: {outcome.changed}")
    if verdict.first is not None:
        lines.append(f"  first difference: {verdict.first}")
        if outcome.inputs:
            lines.append(f"  inputs there: {outcome.inputs}")
    if verdict.missing:
        named = "; ".join(f"{name} (tick {tick})" for tick, name in verdict.missing[:_SHOWN])
        more = len(verdict.missing) - _SHOWN
        rest = f" and {more} more" if more > 0 else ""
        lines.append(f"  input missing from the recording: {named}{rest}")
        if not outcome.changed:
            lines.append(f"  nothing after tick {verdict.last} can be compared")
    lines += [f"  {_what(file.suffix)}: {file}" for file in outcome.files]
    return "\n".join(lines)


def _counts(outcome: ReplayOutcome) -> str:
    """What differs, what is equal, what the recorder lost."""
    verdict, names = outcome.verdict, [topic.name for topic in reversed(COMPARED)]
    differing = [
        f"{verdict.differing[name]} of {_some(verdict.equal[name] + verdict.differing[name], name)}"
        for name in names
        if verdict.differing[name]
    ]
    equal = [
        _some(verdict.equal[name], name)
        for name in names
        if verdict.equal[name] and not verdict.differing[name]
    ]
    lost = [_some(verdict.unrecorded[name], name) for name in names if verdict.unrecorded[name]]
    parts = (
        (differing, "differ"), (equal, "equal to the byte"), (lost, "not in the recording"),
    )  # fmt: skip
    return "; ".join(f"{', '.join(found)} {what}" for found, what in parts if found) or "nothing"


def _some(count: int, name: str) -> str:
    return f"{count} {name}{'' if count == 1 else 's'}"


def _pace(outcome: ReplayOutcome) -> str:
    factor = outcome.seconds / max(outcome.wall, 1e-9)
    return f"{outcome.seconds:.1f} s in {outcome.wall:.1f} s, {factor:.1f} × real time"


def _what(suffix: str) -> str:
    return (
        "figure" if suffix == ".png" else "the QP of that step (python -m quadriga.replay.saved_qp)"
    )
