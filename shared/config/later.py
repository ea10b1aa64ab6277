"""Keys of the configuration that came later than hashes which are still compared with."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from quadriga.shared.config.renamed import with_first_names

# By today's name, `section.key`: the value that all that is older was made with. While a key has
# it, nothing that is hashed tells that there is such a key.
LATER_KEYS: Final[Mapping[str, Any]] = MappingProxyType(
    {
        "team.robot": "a1",
        "team.plant": "mujoco",
        "team.plants": "one",
        "planner.options": "",
        "planner.cost": "own",
        "planner.tracked": "speeds",
        "identification.preset": "usual",
        "identification.wrench_noise": (0.0, 0.0, 0.0, 0.0, 0.0),
        "identification.max_peers_harm": 1000.0,
        "world.stairs_rise": 0.06,
        "world.stairs_run": 0.3,
        "world.stairs_count": 8,
    }
)


def hashed_sections(sections: Mapping[str, Any]) -> dict[str, Any]:
    """Values by section and key as they are hashed and compared across versions.

    A key that came later is left out while it has its value of `LATER_KEYS`; all others stand under
    the names that they had first. So neither a new key nor a new name alone changes a hash.

    Args:
        sections: values by section and key under today's names, as `asdict` gives them.
    """
    return with_first_names({section: _leave_out(section, k) for section, k in sections.items()})


def _leave_out(section: str, keys: Any) -> Any:
    if not isinstance(keys, dict):
        return keys
    return {key: value for key, value in keys.items() if not _is_as_before(section, key, value)}


def _is_as_before(section: str, key: str, value: Any) -> bool:
    name = f"{section}.{key}"
    return name in LATER_KEYS and bool(value == LATER_KEYS[name])
