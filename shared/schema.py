"""JSON schema of every message type, stored with each recording so that any reader knows it."""

from __future__ import annotations

import json
from dataclasses import fields
from functools import cache
from hashlib import sha256
from typing import Any

from quadriga.shared.messages import Message
from quadriga.shared.topics import TABLE

_PLAIN = {
    bool: "boolean",
    int: "integer",
    float: "number",
    str: "string",
    list: "array",
    dict: "object",
}


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
        "description": (kind.__doc__ or "").strip().splitlines()[0],
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }
