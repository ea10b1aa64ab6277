"""What a recording's metadata say beside its configuration; they may come from anybody."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def recorded_versions(metadata: Mapping[str, str]) -> dict[str, str]:
    """Versions of packages by name; none where they are told otherwise than by a recorder."""
    found = _json(metadata, "versions")
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}


def recorded_patterns(metadata: Mapping[str, str], name: str) -> list[str]:
    """Key patterns that a recorder was given as `--topics` or `--exclude`."""
    found = _json(metadata, name)
    return [str(pattern) for pattern in found] if isinstance(found, list) else []


def _json(metadata: Mapping[str, str], name: str) -> Any:
    try:
        return json.loads(metadata.get(name, "null"))
    except (ValueError, RecursionError):  # the latter for what nests too deeply
        return None
