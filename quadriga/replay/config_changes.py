"""Change some keys of a recorded agent's configuration, and refuse what cannot be replayed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from quadriga.agents.agent import Agent
from quadriga.shared.config.load import build, overlay
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import departures
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import find_kind


def change_config(config: Config, given: Mapping[str, Any]) -> Config:
    """The configuration with what was given, by section and key, changed.

    Raises:
        ConfigError: an unknown key or a wrong value.
    """
    overrides = {
        f"{section}.{key}": value for section, keys in given.items() for key, value in keys.items()
    }
    return build(overlay(asdict(config), overrides))


def format_changes(old: Config, new: Config) -> str:
    """Every changed key with its two values, or ""."""
    return ", ".join(f"{name} {was} → {now}" for name, now, was, _ in departures(new, old))


def check_agents(old: Agent, new: Agent) -> None:
    """Refuse a change under which an agent would need messages that it had not taken in.

    Raises:
        ConfigError: it would need other messages than those it had.
    """
    was, now = old.config, new.config
    for key, one, other in (
        ("team.name", was.team.name, now.team.name),
        ("team.robots", was.team.robots, now.team.robots),
    ):
        if one != other:
            raise ConfigError(key, repr(other), f"{one!r} as recorded", "a replay keeps the team")
    new_peers = sorted(set(new.peers) - set(old.peers))
    was_central, is_central = (find_kind(config.planner.kind).central for config in (was, now))
    if was_central != is_central or new_peers:
        raise ConfigError(
            "planner.kind",
            repr(now.planner.kind),
            f"one like the recorded {was.planner.kind!r}",
            f"the agent had taken in no plans of {', '.join(new_peers) or 'such a planner'}",
        )
    if now.estimator.kind == "truth" and was.estimator.kind != "truth":
        raise ConfigError(
            "estimator.kind",
            "'truth'",
            f"{was.estimator.kind!r} as recorded",
            "the agent had not taken in the truth",
        )
