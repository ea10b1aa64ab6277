"""Keys and values of the configuration that had another name once."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

# By their first name, `section.key`. Who writes it is told the new one.
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
# By key, today's name of each value by its first one, which is still read.
RENAMED_VALUES: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {"controller.preset": MappingProxyType({"paper": "plain"})}
)
_FIRST: Final = {new: old for old, new in RENAMED.items()}
_FIRST_VALUES: Final = {
    key: {new: old for old, new in values.items()} for key, values in RENAMED_VALUES.items()
}


def current_name(name: str) -> str:
    """What `section.key`, of whatever version, is called today."""
    return RENAMED.get(name, name)


def current_value(name: str, value: Any) -> Any:
    """What a value of `section.key`, today's name, is called today."""
    return _rename_value(name, value, RENAMED_VALUES)


def with_current_names(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key as another version wrote them, under today's names."""
    return {
        section: _rename(section, keys, RENAMED, RENAMED_VALUES)
        for section, keys in sections.items()
    }


def with_first_names(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key under the names that the keys had first.

    What is hashed or compared across versions has these: a new name alone changes no hash.
    """
    return {
        section: _rename(section, keys, _FIRST, _FIRST_VALUES) for section, keys in sections.items()
    }


def _rename(
    section: str, keys: Any, names: Mapping[str, str], values: Mapping[str, Mapping[str, str]]
) -> Any:
    if not isinstance(keys, dict):
        return keys
    renamed = {}
    for key, value in keys.items():
        name = f"{section}.{key}"
        renamed[names.get(name, name).partition(".")[2]] = _rename_value(name, value, values)
    return renamed


def _rename_value(name: str, value: Any, values: Mapping[str, Mapping[str, str]]) -> Any:
    return values.get(name, {}).get(value, value) if isinstance(value, str) else value
