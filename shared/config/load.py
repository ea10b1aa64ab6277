"""TOML → `Config`, checked once. The only reader of TOML."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import Field, fields
from pathlib import Path
from typing import Any, Final

from quadriga.shared.codec import truncate_text
from quadriga.shared.config.check import check
from quadriga.shared.config.presets import PRESETS, preset_keys
from quadriga.shared.config.reference_trace import ROW_END, inline_trace
from quadriga.shared.config.sections import Config
from quadriga.shared.controller_line import KEY as CONTROLLER
from quadriga.shared.errors import ConfigError, did_you_mean, name_file_errors
from quadriga.shared.planner_kinds import NO_PLANNER
from quadriga.shared.robots.registry import ROBOTS

_SHOWN: Final = 200  # characters of a value that is wrong
_LARGEST: Final = 1 << 22  # bytes of a file: of a reference's trace, which has a line of its own
_MANY_PARTS: Final = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"(?:\\.|[^"\\\n])*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){100}"""
)


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
        given = overlay(given, flatten(read_toml(path))) if given else read_toml(path)
    return overlay(given, overrides)


def overlay(given: dict[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """`given`, by section and key, with `overrides`, by `section.key`, on top.

    A preset that comes with the overrides also replaces what the file says of the keys that
    presets set, so that a file with every key written out can still be walked with another one.
    The path of a trace gives way to what the file says. A controller of one's own that comes with
    the overrides replaces what the file says of the kind of planner.

    Raises:
        ConfigError: an override names no key, or there is no such trace.
    """
    if overrides.get(CONTROLLER) and isinstance(given.get("planner"), dict):
        given["planner"] = {k: v for k, v in given["planner"].items() if k != "kind"}
    for section in PRESETS:
        if f"{section}.preset" in overrides and isinstance(given.get(section), dict):
            replaced = preset_keys(section)
            given[section] = {k: v for k, v in given[section].items() if k not in replaced}
    for name, value in overrides.items():
        section, dot, key = name.partition(".")
        if not dot or not isinstance(given.setdefault(section, {}), dict):
            raise ConfigError(name, "a value", "section.key")
        given[section][key] = value
    reference = given.get("reference")
    trace = reference.get("trace") if isinstance(reference, dict) else None
    if isinstance(trace, str) and "/" in trace and ROW_END not in trace:
        given["reference"]["trace"] = inline_trace(Path(trace))
    return given


def build(given: Mapping[str, Any]) -> Config:
    """The configuration with these values; for the rest the presets', the robot's, the defaults.

    Raises:
        ConfigError: see `load`.
    """
    for section, presets in PRESETS.items():
        keys = given.get(section, {})
        if isinstance(keys, dict):
            preset = keys.get("preset")
            beneath = presets.get(preset, {}) if isinstance(preset, str) else {}
            given = {**given, section: {**beneath, **keys}}
    given = _without_planner(_with_robots_values(given))
    known = {item.name: item for item in fields(Config)}
    for section in given.keys() - known.keys():
        raise _unknown_name(section, list(known), "a section")
    config = Config(
        **{name: _build_section(item, given.get(name, {})) for name, item in known.items()}
    )
    check(config)
    return config


def _with_robots_values(given: Mapping[str, Any]) -> Mapping[str, Any]:
    """`given` with what the robot has beneath; a kind that there is not is refused later."""
    team = given.get("team", {})
    kind = team.get("robot") if isinstance(team, dict) else None
    if not isinstance(kind, str) or kind not in ROBOTS:
        return given
    filled = dict(given)
    for name, value in ROBOTS[kind].defaults.items():
        section, _, key = name.partition(".")
        keys = filled.get(section, {})
        if isinstance(keys, dict):
            filled[section] = {key: value, **keys}
    return filled


def _without_planner(given: Mapping[str, Any]) -> Mapping[str, Any]:
    """`given` with no planner beneath where a controller of one's own takes the agents' place."""
    team, planner = given.get("team", {}), given.get("planner", {})
    controlled = isinstance(team, dict) and team.get("agent_command")
    if not controlled or not isinstance(planner, dict):
        return given
    return {**given, "planner": {"kind": NO_PLANNER, **planner}}


def parse_assignment(text: str, option: str = "--set") -> tuple[str, Any]:
    """`section.key=value` with a TOML value; a bare word counts as text.

    Raises:
        ConfigError: there is no `=`.
    """
    name, separator, value = text.partition("=")
    if not separator:
        raise ConfigError(option, show_value(text), "section.key=value")
    try:
        return name.strip(), _parse_toml(name.strip(), f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return name.strip(), value.strip()


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
        ConfigError: it cannot be read, or is no TOML.
    """
    with name_file_errors(ConfigError, path, "a readable TOML file"), path.open("rb") as file:
        text = file.read(_LARGEST + 1).decode("utf-8-sig")  # some editors begin with a mark
    try:
        return _parse_toml(str(path), text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), truncate_text(str(error), _SHOWN), "TOML") from None


def _parse_toml(name: str, text: str) -> dict[str, Any]:
    """What a text says.

    Raises:
        ConfigError: it is TOML, but nests too deeply or has a number of too many digits, or is
            larger than any that is meant: the parser needs the square of a key's parts.
        tomllib.TOMLDecodeError: it is none.
    """
    if len(text) > _LARGEST:
        raise ConfigError(name, f"more than {_LARGEST:,} bytes", "a TOML file of some 25,000")
    if _MANY_PARTS.search(text):
        raise ConfigError(name, "a key of more than 100 parts", "section.key")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise ConfigError(name, "values nested in values", "sections of keys") from None
    except ValueError:
        raise ConfigError(
            name, "a number of thousands of digits", "one that a key can have"
        ) from None


def _build_section(item: Field[Any], given: Any) -> Any:
    kind = item.default_factory
    if not isinstance(given, dict):
        raise ConfigError(item.name, show_value(given), f"a section, written [{item.name}]")
    known = {key.name: key for key in fields(kind)}  # type: ignore[arg-type]
    for name in given.keys() - known.keys():
        raise _unknown_name(f"{item.name}.{name}", [f"{item.name}.{key}" for key in known], "a key")
    values = {
        name: _check_value(f"{item.name}.{name}", known[name], v) for name, v in given.items()
    }
    return kind(**values)  # type: ignore[operator]


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
    if isinstance(default, str):
        return _check_text(name, meta, value)
    return _check_number(name, meta, type(default), value)


def _check_text(name: str, meta: Mapping[str, Any], value: Any) -> str:
    choices: tuple[str, ...] = meta["choices"]
    if choices and value not in choices and not meta["more"]:
        meant = did_you_mean(value, choices) if isinstance(value, str) else ""
        hint = "; ".join(filter(None, (meta["hint"], meant)))
        raise ConfigError(name, show_value(value), f"one of {', '.join(choices)}", hint)
    if not isinstance(value, str) or not value.isprintable():
        raise ConfigError(name, show_value(value), "text without control characters")
    return value


def show_value(value: Any) -> str:
    """A value in a few words; what nests deeply or has thousands of digits has no other text."""
    try:
        return truncate_text(repr(value), _SHOWN)
    except (ValueError, RecursionError):
        return f"a {type(value).__name__} that is too large to show"


def is_finite(value: float) -> bool:
    """Whether a number of a TOML file is one that can be computed with."""
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond all floating-point numbers
        return False


def _check_number(name: str, meta: Mapping[str, Any], kind: type, value: Any) -> Any:
    low, high = meta["low"], meta["high"]
    what = "an integer" if kind is int else "a finite number"
    if low is not None and high is not None:
        what += f" in [{low:.10g}, {high:.10g}]"
    elif low is not None:
        what += f" ≥ {low:g}"
    what += _unit(meta)
    right_type = type(value) is int or (kind is float and type(value) is float)
    if not right_type or not is_finite(value):
        raise ConfigError(name, show_value(value), what)
    if (low is not None and value < low) or (high is not None and value > high):
        raise ConfigError(name, show_value(value), what, "out of range")
    return kind(value)


def _unit(meta: Mapping[str, Any]) -> str:
    return "" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]"


def _unknown_name(name: str, known: list[str], what: str) -> ConfigError:
    hint = did_you_mean(name, known) or f"known: {', '.join(known)}"
    return ConfigError(name, "an unknown name", f"{what} of the configuration", hint)
