"""What a recording holds beside its messages: configuration, predictor, versions.

A recording may come from anybody, so whoever reads it takes nothing of this for granted.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

from quadriga.shared.agent_command import command_origin
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.planner_kinds import installed_kinds, plugin_origin
from quadriga.shared.recording.metadata import COUNTS
from quadriga.shared.runtime.installed import package_versions

_DIGITS: Final = 18  # of a number of messages that can be meant


def build_metadata(config: Config, predictor_sha256: str) -> dict[str, str]:
    """The metadata of a recording made now; `Recording.metadata` hands them back.

    Raises:
        ConfigError: the file of a controller of one's own cannot be read.
    """
    origin = command_origin(config.team.agent_command)
    return {
        "team": config.team.name,
        "scenario": config.world.scenario,
        "config_json": json.dumps(asdict(config), sort_keys=True),
        "config_sha256": config_sha256(config),
        "predictor_sha256": predictor_sha256,
        "versions": json.dumps(installed_versions(config.planner.kind)),
        **({"controller": origin} if origin else {}),
    }


def installed_versions(planner: str = "none") -> dict[str, str]:
    """Versions of what a run's figures depend on, by the name of the package.

    Args:
        planner: kind of planner; the package of a plug-in is named with the digest of its files.

    Raises:
        ConfigError: no installed package has this kind.
    """
    package, _, version = plugin_origin(planner).partition(" ")
    return package_versions() | ({package: version} if package else {})


def recorded_versions(metadata: Mapping[str, str]) -> dict[str, str]:
    """Versions of packages by name; none where the metadata are not a recorder's."""
    versions = _parse_json(metadata, "versions")
    return {str(k): str(v) for k, v in versions.items()} if isinstance(versions, dict) else {}


def differing_versions(metadata: Mapping[str, str]) -> str:
    """Packages that had another version when recorded, as text; "" if there are none."""
    here = installed_versions(_recorded_kind(metadata))
    return ", ".join(
        f"{name} {version} (here {here.get(name, 'absent')})"
        for name, version in recorded_versions(metadata).items()
        if here.get(name) != version
    )


def recorded_patterns(metadata: Mapping[str, str], name: str) -> list[str]:
    """Key patterns that a recorder was given as `--topics` or `--exclude`."""
    patterns = _parse_json(metadata, name)
    return [str(pattern) for pattern in patterns] if isinstance(patterns, list) else []


def _recorded_kind(metadata: Mapping[str, str]) -> str:
    """The kind of planner, or "none" where it is not recorded or no longer installed."""
    config = _parse_json(metadata, "config_json")
    planner = config.get("planner") if isinstance(config, dict) else None
    kind = planner.get("kind") if isinstance(planner, dict) else None
    return kind if kind in installed_kinds() else "none"


def _parse_json(metadata: Mapping[str, str], name: str) -> Any:
    try:
        return json.loads(metadata.get(name, "null"))
    except (ValueError, RecursionError):  # the latter for what nests too deeply
        return None


def read_counts(notes: Mapping[str, Mapping[str, str]]) -> dict[str, int]:
    """What the writer counted, by name, from the notes of a recording; {} if it was killed."""
    counts = notes.get(COUNTS, {})
    return {
        name: int(text)
        for name, text in counts.items()
        if text.isdecimal() and len(text) <= _DIGITS
    }
