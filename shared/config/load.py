"""TOML → `Config`, checked once. The only reader of TOML."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import Field, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from quadriga.shared.config.payload import carriers
from quadriga.shared.config.presets import PRESETS, preset_keys
from quadriga.shared.config.reference_trace import ROW_END, inlined
from quadriga.shared.config.renamed import RENAMED
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.wire.topics import SAMPLE_MS

_TEAM_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_PAIRS: Final = (
    "identification.vx",
    "identification.vy",
    "identification.wz",
    "identification.gain_range",
)
_ANSWER: Final = 1.0  # s wall, for a robot's step once it has waited for a peer in vain
_LEAST_PEBBLE: Final = 0.005  # m; the ground holds millions of smaller stones


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
        given = overlaid(given, flattened(read_toml(path))) if given else read_toml(path)
    return overlaid(given, overrides)


def overlaid(given: dict[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """`given`, by section and key, with `overrides`, by `section.key`, on top.

    A preset that comes with the overrides also replaces what the file says of the keys that
    presets set, so that a file with every key written out can still be walked with another one.
    The path of a trace gives way to what the file says.

    Raises:
        ConfigError: an override names no key, or there is no such trace.
    """
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
        given["reference"]["trace"] = inlined(Path(trace))
    return given


def build(given: Mapping[str, Any]) -> Config:
    """The configuration with these values; the presets', then the defaults, for the rest.

    Raises:
        ConfigError: see `load`.
    """
    for section, presets in PRESETS.items():
        keys = given.get(section, {})
        if isinstance(keys, dict):
            given = {**given, section: {**presets.get(str(keys.get("preset")), {}), **keys}}
    known = {item.name: item for item in fields(Config)}
    for section in given.keys() - known.keys():
        raise _unknown(section, list(known), "a section")
    config = Config(**{name: _section(item, given.get(name, {})) for name, item in known.items()})
    _check_together(config)
    return config


def parse_assignment(text: str, option: str = "--set") -> tuple[str, Any]:
    """`section.key=value` with a TOML value; a bare word counts as text.

    Raises:
        ConfigError: there is no `=`.
    """
    name, found, value = text.partition("=")
    if not found:
        raise ConfigError(option, repr(text), "section.key=value")
    try:
        return name.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return name.strip(), value.strip()


def flattened(tables: Mapping[str, Any]) -> dict[str, Any]:
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
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(str(path), reason, "a readable TOML file") from None
    except UnicodeDecodeError:
        raise ConfigError(str(path), "bytes that are not UTF-8", "a TOML file") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), str(error), "TOML") from None


def _section(item: Field[Any], given: Any) -> Any:
    kind = item.default_factory
    if not isinstance(given, dict):
        raise ConfigError(item.name, repr(given), f"a section, written [{item.name}]")
    known = {key.name: key for key in fields(kind)}  # type: ignore[arg-type]
    for name in given.keys() - known.keys():
        raise _unknown(f"{item.name}.{name}", [f"{item.name}.{key}" for key in known], "a key")
    values = {name: _value(f"{item.name}.{name}", known[name], v) for name, v in given.items()}
    return kind(**values)  # type: ignore[operator]


def _value(name: str, key: Field[Any], value: Any) -> Any:
    """The value of a key in the type of its default, or one error about it."""
    default, meta = key.default, key.metadata
    if isinstance(default, tuple):
        if not isinstance(value, (list, tuple)) or len(value) != len(default):
            raise ConfigError(name, repr(value), f"{len(default)} numbers{_unit(meta)}")
        return tuple(_number(f"{name}[{i}]", meta, float, v) for i, v in enumerate(value))
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise ConfigError(name, repr(value), "true or false")
        return value
    if isinstance(default, str):
        return _text(name, meta["choices"], value)
    return _number(name, meta, type(default), value)


def _text(name: str, choices: tuple[str, ...], value: Any) -> str:
    if choices and value not in choices:
        close = get_close_matches(str(value), choices, 1)
        hint = f"did you mean {close[0]!r}?" if close else ""
        raise ConfigError(name, repr(value), f"one of {', '.join(choices)}", hint)
    if not isinstance(value, str) or not value.isprintable():
        raise ConfigError(name, repr(value), "text without control characters")
    return value


def _finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond all floating-point numbers
        return False


def _number(name: str, meta: Mapping[str, Any], kind: type, value: Any) -> Any:
    low, high = meta["low"], meta["high"]
    what = "an integer" if kind is int else "a finite number"
    if low is not None and high is not None:
        what += f" in [{low:.10g}, {high:.10g}]"
    elif low is not None:
        what += f" ≥ {low:g}"
    what += _unit(meta)
    right_type = type(value) is int or (kind is float and type(value) is float)
    if not right_type or not _finite(value):
        raise ConfigError(name, repr(value), what)
    if (low is not None and value < low) or (high is not None and value > high):
        raise ConfigError(name, f"{value!r}", what, "out of range")
    return kind(value)


def _unit(meta: Mapping[str, Any]) -> str:
    return "" if meta["unit"] in ("-", "1") else f" [{meta['unit']}]"


def _unknown(name: str, known: list[str], what: str) -> ConfigError:
    if name in RENAMED:
        return ConfigError(
            name, "a name of an earlier version", RENAMED[name], "the key was renamed, not changed"
        )
    close = get_close_matches(name, known, 1)
    hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
    return ConfigError(name, "an unknown name", f"{what} of the configuration", hint)


def _check_together(config: Config) -> None:
    """Rules that need more than one key, or more than a range."""
    if not _TEAM_NAME.fullmatch(config.team.name):
        raise ConfigError(
            "team.name",
            repr(config.team.name),
            "1 to 64 letters, digits, . _ or -",
            "it is the first part of every key",
        )
    for name, value in (("stance_ms", config.gait.stance_ms), ("stand_ms", config.gait.stand_ms)):
        if value % SAMPLE_MS:
            raise ConfigError(
                f"gait.{name}", str(value), f"a multiple of {SAMPLE_MS} ms", "the planner's samples"
            )
    names = robot_names(config.team.robots)
    carriers(config.world.payload_on, names)
    for push in filter(None, config.world.push.split(",")):
        robot = push.partition(":")[0].strip()
        if robot not in ("all", *names):
            raise ConfigError(
                "world.push", f"a push on {robot!r}", f"all or one of {', '.join(names)}"
            )
    if config.world.command_damp_ms < config.world.command_hold_ms:
        raise ConfigError(
            "world.command_damp_ms",
            str(config.world.command_damp_ms),
            f"at least world.command_hold_ms = {config.world.command_hold_ms}",
            "a late command is held first, then damped",
        )
    if config.world.terrain == "pebbles" and config.world.terrain_height < _LEAST_PEBBLE:
        raise ConfigError(
            "world.terrain_height",
            f"{config.world.terrain_height:g}",
            f"at least {_LEAST_PEBBLE:g} m for terrain 'pebbles'",
            "the height of the largest stones; terrain 'flat' has none",
        )
    _check_planner(config)
    for pair in _PAIRS:
        section, _, key = pair.partition(".")
        first, last = getattr(getattr(config, section), key)
        if first > last:
            raise ConfigError(pair, f"[{first}, {last}]", "[least, greatest]")


def _check_planner(config: Config) -> None:
    """Plans reach from one to the next, and who waits for a peer's is waited for."""
    planner, patience = config.planner, config.world.command_timeout
    if planner.applied > planner.N:
        raise ConfigError(
            "planner.applied", str(planner.applied), f"at most planner.N = {planner.N}"
        )
    if planner.kind == "none":
        return
    latency = max(1, planner.latency_ms) if planner.kind in CENTRAL else planner.latency_ms
    longest = SAMPLE_MS * (planner.N - planner.applied)
    if latency > longest:
        raise ConfigError(
            "planner.latency_ms",
            str(planner.latency_ms),
            f"at most {SAMPLE_MS}·(planner.N − planner.applied) = {longest} ms",
            "a plan would have run out before the next one takes effect",
        )
    least = planner.peer_timeout + _ANSWER
    if config.world.mode == "lockstep" and patience < least:
        raise ConfigError(
            "world.command_timeout",
            f"{patience:g}",
            f"at least planner.peer_timeout + {_ANSWER:g} s = {least:g} s",
            "else robots that wait for a frozen peer's plan count as frozen too",
        )
