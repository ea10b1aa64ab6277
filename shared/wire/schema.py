"""JSON schema of every message type, stored with each recording so that any reader knows it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from quadriga.shared.wire.messages import Message

_PLAIN = {
    bool: "boolean",
    int: "integer",
    float: "number",
    str: "string",
    list: "array",
    dict: "object",
}


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
