"""TOML → `Config`, checked once. The only reader of TOML."""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import Field, fields
from pathlib import Path
from typing import Any, Final

from quadriga.shared.agent_command import KEY as AGENT_COMMAND
from quadriga.shared.codec import truncate_text
from quadriga.shared.config.check import check
from quadriga.shared.config.presets import PRESETS, preset_keys
from quadriga.shared.config.reference_trace import ROW_END, inline_trace
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, did_you_mean, name_file_errors
from quadriga.shared.planner_kinds import NO_PLANNER
from quadriga.shared.robots.registry import ROBOTS

_SHOWN: Final = 200  # characters of a value that is wrong
_LARGEST: Final = 1 << 22  # bytes of a file


def load(path: Path | None = None, overrides: Mapping[str, Any] | None = None) -> Config:
    """The configuration in a TOML file, or the default one, with some keys replaced.

    Args:
        path: the file; None takes every default.
        overrides: values by `section.key`; they win over the file.

    Raises:
        ConfigError: the file cannot be read or parsed; a section or key is unknown; a value has
            the wrong type, length or range; or two keys contradict each other.
    """
    return build(layers(path, overrides or {}))


def layers(
    path: Path | None, overrides: Mapping[str, Any], beneath: Path | None = None
) -> dict[str, Any]:
    """What is given explicitly, by section and key: `beneath`, the file, then `overrides` on top.

    Raises:
        ConfigError: a file cannot be read or parsed, or an override names no key.
    """
    given = read_toml(beneath) if beneath else {}
    if path:
        given = overlay(given, flatten(read_toml(path))) if beneath else read_toml(path)
    return overlay(given, overrides)


def overlay(given: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """`given`, by section and key, with `overrides`, by `section.key`, on top.

    A preset among the overrides also replaces what `given` says of the keys that presets set, so
    that a file with every key written out can be walked with another one; an agent's command
    replaces its kind of planner. The name of a trace gives way to what the file says.

    Raises:
        ConfigError: an override names no key, or there is no such trace.
    """
    dropped = {"planner.kind"} if overrides.get(AGENT_COMMAND) else set()
    for section in PRESETS:
        if f"{section}.preset" in overrides:
            dropped |= {f"{section}.{key}" for key in preset_keys(section)}
    merged = {
        section: {key: value for key, value in keys.items() if f"{section}.{key}" not in dropped}
        if isinstance(keys, dict)
        else keys
        for section, keys in given.items()
    }
    for name, value in overrides.items():
        section, dot, key = name.partition(".")
        if not dot or not isinstance(merged.setdefault(section, {}), dict):
            raise ConfigError(name, "a value", "section.key")
        merged[section][key] = value
    trace = flatten(merged).get("reference.trace")
    if isinstance(trace, str) and trace.isprintable() and trace and ROW_END not in trace:
        merged["reference"]["trace"] = inline_trace(trace)
    return merged


def build(given: Mapping[str, Any]) -> Config:
    """The configuration with these values; for the rest the presets', the robot's, the defaults.

    Raises:
        ConfigError: see `load`.
    """
    sections = {item.name: item for item in fields(Config)}
    for name, keys in given.items():
        if name not in sections:
            raise _unknown_name(name, list(sections), "a section")
        if not isinstance(keys, dict):
            raise ConfigError(name, show_value(keys), f"a section, written [{name}]")
    values = {**_beneath(flatten(given)), **flatten(given)}
    by_section: dict[str, dict[str, Any]] = {name: {} for name in sections}
    for name, value in values.items():
        section, _, key = name.partition(".")
        by_section[section][key] = value
    built = {name: _build_section(item, by_section[name]) for name, item in sections.items()}
    config = Config(**built)
    check(config)
    return config


def _beneath(given: Mapping[str, Any]) -> dict[str, Any]:
    """What stands beneath the values that are given, by `section.key`, instead of the defaults.

    That is what the robot's record says, then the presets. What is wrong is refused later.
    """
    robot = given.get("team.robot")
    found = dict(ROBOTS[robot].defaults) if isinstance(robot, str) and robot in ROBOTS else {}
    if given.get(AGENT_COMMAND):
        found["planner.kind"] = NO_PLANNER
    for section, presets in PRESETS.items():
        preset = given.get(f"{section}.preset")
        values = presets.get(preset, {}) if isinstance(preset, str) else {}
        found |= {f"{section}.{key}": value for key, value in values.items()}
    return found


def parse_assignment(text: str, option: str = "--set") -> tuple[str, Any]:
    """`section.key=value` with a TOML value; a bare word counts as text.

    Raises:
        ConfigError: there is no `=`.
    """
    name, separator, value = (part.strip() for part in text.partition("="))
    if not separator:
        raise ConfigError(option, show_value(text), "section.key=value")
    try:
        return name, _parse_toml(name, f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return name, value


def flatten(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Values by `section.key` of tables by section; what is no table keeps its name."""
    return {
        f"{section}.{key}" if key else section: value
        for section, keys in tables.items()
        for key, value in (keys.items() if isinstance(keys, dict) else [("", keys)])
    }


def read_toml(path: Path) -> dict[str, Any]:
    """What a TOML file says.

    Raises:
        ConfigError: it cannot be read, is no TOML, or would take the memory.
    """
    with name_file_errors(ConfigError, path, "a readable TOML file"), path.open("rb") as file:
        content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise ConfigError(str(path), f"more than {_LARGEST:,} bytes", "a TOML file")
        text = content.decode("utf-8-sig")  # some editors begin with a mark
    try:
        return _parse_toml(str(path), text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), truncate_text(str(error), _SHOWN), "TOML") from None


def _parse_toml(name: str, text: str) -> dict[str, Any]:
    """What a text says.

    Raises:
        ConfigError: it nests too deeply or has a number of too many digits.
        tomllib.TOMLDecodeError: it is no TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (RecursionError, ValueError):
        got = "values nested in values, or a number of thousands of digits"
        raise ConfigError(name, got, "sections of keys") from None


def _build_section(item: Field[Any], given: Mapping[str, Any]) -> Any:
    kind: Any = item.default_factory
    known = {key.name: key for key in fields(kind)}
    for name in given.keys() - known.keys():
        raise _unknown_name(f"{item.name}.{name}", [f"{item.name}.{key}" for key in known], "a key")
    return kind(**{n: _check_value(f"{item.name}.{n}", known[n], v) for n, v in given.items()})


def _check_value(name: str, key: Field[Any], value: Any) -> Any:
    """The value of a key in the type of its default, or one error about it."""
    default, meta = key.default, key.metadata
    if isinstance(default, tuple):
        if not isinstance(value, (list, tuple)) or len(value) != len(default):
            raise ConfigError(name, show_value(value), f"{len(default)} numbers{_unit(meta)}")
        return tuple(_check_number(f"{name}[{i}]", meta, float, v) for i, v in enumerate(value))
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise ConfigError(name, show_value(value), "true or false")
        return value
    if not isinstance(default, str):
        return _check_number(name, meta, type(default), value)
    choices = meta["choices"]
    if choices and value not in choices and not meta["more"]:
        hint = did_you_mean(value, choices) if isinstance(value, str) else ""
        raise ConfigError(name, show_value(value), f"one of {', '.join(choices)}", hint)
    if not isinstance(value, str) or not value.isprintable():
        raise ConfigError(name, show_value(value), "text without control characters")
    return value


def _check_number(name: str, meta: Mapping[str, Any], kind: type, value: Any) -> Any:
    low, high = meta["low"], meta["high"]
    what = "an integer" if kind is int else "a finite number"
    what += f" in [{low:.10g}, {high:.10g}]" if high < math.inf else f" ≥ {low:g}"
    what += _unit(meta)
    right_type = type(value) is int or (kind is float and type(value) is float)
    if not right_type or not is_finite(value):
        raise ConfigError(name, show_value(value), what)
    if not low <= value <= high:
        raise ConfigError(name, show_value(value), what, "out of range")
    return kind(value)


def show_value(value: Any) -> str:
    """A value in a few words; what nests deeply or has thousands of digits has no other text."""
    try:
        return truncate_text(repr(value), _SHOWN)
    except (ValueError, RecursionError):
        return f"a {type(value).__name__} that is too large to show"


def is_finite(value: float) -> bool:
    """Whether a number of a TOML file is one that can be computed with."""
    return abs(value) <= sys.float_info.max  # which an integer may be beyond


def _unit(meta: Mapping[str, Any]) -> str:
    return "" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]"


def _unknown_name(name: str, known: list[str], what: str) -> ConfigError:
    hint = did_you_mean(name, known) or f"known: {', '.join(known)}"
    return ConfigError(name, "an unknown name", f"{what} of the configuration", hint)
