"""Keys of the configuration that had another name once: by their first name, `section.key`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

RENAMED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "controller.follow_fall": "controller.track_sinking_trunk",
        "controller.give_way_ms": "controller.reflex_ms",
        "controller.leash": "controller.position_error_limit",
        "controller.mu_least": "controller.mu_min",
        "controller.stumble_lift": "controller.reflex_lift",
        "controller.tell_sides": "controller.reject_side_contacts",
    }
)
_FIRST: Final = {new: old for old, new in RENAMED.items()}


def current_name(name: str) -> str:
    """What `section.key`, of whatever version, is called today."""
    return RENAMED.get(name, name)


def with_current_names(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key as another version wrote them, under today's names."""
    return {section: _rename(section, keys, RENAMED) for section, keys in sections.items()}


def with_first_names(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key under the names that the keys had first.

    What is hashed or compared across versions has these: a new name alone changes no hash.
    """
    return {section: _rename(section, keys, _FIRST) for section, keys in sections.items()}


def _rename(section: str, keys: Any, names: Mapping[str, str]) -> Any:
    if not isinstance(keys, dict):
        return keys
    return {
        names.get(f"{section}.{key}", f"{section}.{key}").partition(".")[2]: value
        for key, value in keys.items()
    }
