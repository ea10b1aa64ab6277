"""The table of topics and their messages as a page: `python -m quadriga.shared.messages_page`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

from quadriga.shared.about import QUESTIONS
from quadriga.shared.messages import Message
from quadriga.shared.topic import CONFIGURED, Topic
from quadriga.shared.topics import TABLE

_HEAD = """\
# Topics and messages

The messages between the processes of a team. A key on the bus is `<team>/<robot>/<topic>` where a
topic is one per robot, else `<team>/<topic>`; the planner and the sim server (or each robot's
plant, `plant_r1` …) have a `status` under their own names. Every message also carries `tick` [ms]
and `stamp_ns` [ns], the world's time of its content. Periods and ages are world time; the last
column tells what is recorded.
This page is generated: `python -m quadriga.shared.messages_page > docs/messages.md`.

| topic | per robot | message | from | to | period | maximum age | recorded |
|---|---|---|---|---|---|---|---|
"""

_QUESTIONS = """\

## Questions

What each process answers when it is asked (a query of Zenoh) on `<team>/<process>/<question>`,
before the walk and during it. Nothing of it is recorded.

| question | answer | asked by |
|---|---|---|
"""


def to_markdown() -> str:
    """The page: the table of topics, then a table for each message; the same of questions."""
    rows = "".join(f"| {' | '.join(_row(topic))} |\n" for topic in TABLE)
    messages = "".join(map(_section, dict.fromkeys(topic.type for topic in TABLE)))
    questions = "".join(
        f"| `{item.name}` | [{item.type.__name__}](#{item.type.__name__.lower()}) "
        f"| {', '.join(item.askers)} |\n"
        for item in QUESTIONS
    )
    answers = "".join(_section(item.type) for item in QUESTIONS)
    return _HEAD + rows + messages + _QUESTIONS + questions + answers


def _row(topic: Topic) -> Iterator[str]:
    yield f"`{topic.name}`"
    yield "yes" if topic.per_robot else ""
    yield f"[{topic.type.__name__}](#{topic.type.__name__.lower()})"
    yield ", ".join(topic.senders)
    yield ", ".join(topic.receivers)
    yield _time(topic.period_ms, "on event")
    yield _time(topic.max_age_ms, "")
    yield "yes" if topic.recorded else "no"


def _time(ms: int, nothing: str) -> str:
    if ms == CONFIGURED:
        return "configured"
    return f"{ms} ms" if ms else nothing


def _section(kind: type[Message]) -> str:
    summary = (kind.__doc__ or "").strip().splitlines()[0]
    lines = ["", f"## {kind.__name__}", "", summary, ""]
    own = [item for item in fields(kind) if item.name not in ("tick", "stamp_ns")]
    if own:
        lines += ["| field | shape | unit | frame, or meaning |", "|---|---|---|---|"]
    for item in own:
        meta = item.metadata
        if "shape" in meta:
            shape = " × ".join(map(str, meta["shape"]))
            lines.append(f"| `{item.name}` | {shape} | {meta['unit']} | {meta['frame']} |")
        else:
            lines.append(f"| `{item.name}` | {meta['kind'].__name__} | | {meta['doc']} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(to_markdown(), end="")
