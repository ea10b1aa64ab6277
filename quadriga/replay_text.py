"""What a replay tells its user: one line for each robot, more where something differs."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final

from agents.intake import taken_in
from quadriga.rerun import COMPARED, Step

if TYPE_CHECKING:
    from quadriga.replay import Outcome

_SHOWN: Final = 3  # messages missing from the recording that are named
_IDENTICAL: Final = "equal to the byte"


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


def described(outcome: Outcome) -> str:
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


def _counts(outcome: Outcome) -> str:
    verdict, parts = outcome.verdict, []
    for name in (topic.name for topic in reversed(COMPARED)):
        equal, differing = verdict.equal[name], verdict.differing[name]
        if differing:
            parts.append(f"{differing} of {equal + differing} {name}s differ")
        elif equal:
            parts.append(f"{equal} {name}s {_IDENTICAL}")
        if lost := verdict.unrecorded[name]:
            parts.append(f"{lost} {name}s not in the recording")
    text = ", ".join(parts)
    # Said once at the end of a row of counts, it reads better than after each.
    return text.replace(f" {_IDENTICAL},", ",", text.count(f" {_IDENTICAL},")) if parts else "none"


def _pace(outcome: Outcome) -> str:
    factor = outcome.seconds / max(outcome.wall, 1e-9)
    return f"{outcome.seconds:.1f} s in {outcome.wall:.1f} s, {factor:.1f} × real time"


def _what(suffix: str) -> str:
    return "figure" if suffix == ".png" else "the QP of that step (python -m quadriga.saved_qp)"
