"""What messages look like, for other programs: JSON schemas, their digests, and a page.

Each recording holds the schemas of its messages, so that any reader knows them.
`python -m quadriga.shared.schema` prints the page.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from hashlib import sha256
from typing import Any

from quadriga.shared.messages import Message
from quadriga.shared.topics import CONFIGURED, TABLE, Topic

_PLAIN: dict[type, str] = {
    **{bool: "boolean", int: "integer", float: "number"},
    **{str: "string", list: "array", dict: "object"},
}
_HEAD = """\
# Topics and messages

The messages between the processes of a team. A key on the bus is `<team>/<robot>/<topic>` where a
topic is one per robot, else `<team>/<topic>`; the planner and the sim server (or each robot's
plant, `plant_r1` …) have a `status` and `ticks` under their own names. `state` and `command` go
over the plant link, and are recorded out of `ticks`. Every message also carries `tick` [ms] and
`stamp_ns` [ns], the world's time of its content. Periods and ages are world time.
This page is generated: `python -m quadriga.shared.schema > docs/messages.md`.

| topic | per robot | message | from | to | period | maximum age | recorded |
|---|---|---|---|---|---|---|---|
"""


@cache
def message_forms() -> tuple[str, ...]:
    """Name of each topic of this process, and digest of the form that its messages have."""
    return tuple(
        f"{topic.name} {sha256(json.dumps(_form(topic.type)).encode()).hexdigest()[:12]}"
        for topic in TABLE
    )


def _form(kind: type[Message]) -> dict[str, Any]:
    """What two processes must have in common to read each other's messages, without prose."""
    names = ("const", "type", "x-shape", "x-unit", "x-frame")
    properties = json_schema(kind)["properties"].items()
    return {name: [has.get(key) for key in names] for name, has in properties}


def json_schema(kind: type[Message]) -> dict[str, Any]:
    """JSON schema of the MessagePack map of a message type.

    Arrays are `bin` values; `x-dtype`, `x-shape`, `x-unit` and `x-frame` say how to read them.
    """
    properties: dict[str, Any] = {"schema": {"const": kind.SCHEMA}}
    for item in fields(kind):
        meta = item.metadata
        if "shape" in meta:
            properties[item.name] = {
                "type": "string", "contentEncoding": "binary", "x-dtype": "<f8",
                "x-shape": list(meta["shape"]), "x-unit": meta["unit"], "x-frame": meta["frame"],
            }  # fmt: skip
        else:
            properties[item.name] = {"type": _PLAIN[meta["kind"]], "description": meta["doc"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"quadriga.{kind.__name__}",
        "description": (kind.__doc__ or "").partition("\n")[0],
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def to_markdown() -> str:
    """The page: the table of topics, then a table for each message."""
    rows = "".join(f"| {' | '.join(_row(topic))} |\n" for topic in TABLE)
    return _HEAD + rows + "".join(map(_section, dict.fromkeys(topic.type for topic in TABLE)))


def _row(topic: Topic) -> Iterator[str]:
    yield f"`{topic.name}`"
    yield "yes" if topic.per_robot else ""
    yield f"[{topic.type.__name__}](#{topic.type.__name__.lower()})"
    yield ", ".join(topic.senders)
    yield ", ".join(topic.receivers)
    for ms, nothing in ((topic.period_ms, "on event"), (topic.max_age_ms, "")):
        yield "configured" if ms == CONFIGURED else f"{ms} ms" if ms else nothing
    yield "yes" if topic.recorded else "no"


def _section(kind: type[Message]) -> str:
    lines = ["", f"## {kind.__name__}", "", (kind.__doc__ or "").partition("\n")[0], ""]
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
