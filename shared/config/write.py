"""`Config` → text: a TOML file, a table, a hash, and what a team's processes must agree on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Container, Iterator, Mapping
from dataclasses import asdict, fields
from math import inf
from typing import Any, Final

from quadriga.shared.config.sections import Config

# Sections that are a computer's own: where it is reached, how it runs programs.
_OWN_SECTIONS: Final = ("bus", "runtime")
# What of them the whole team rests on: how long it waits.
_AGREED: Final = ("bus.clock_timeout",)
# Single keys that are a computer's own: a label, names of files (what is in these is part of the
# predictor), where a robot hangs.
_OWN: Final = (
    *("world.scenario", "identification.response"),
    *("bridge.endpoint", "bridge.listen", "bridge.interface", "bridge.domain"),
)
_LONGEST: Final = 80  # characters of a value that is told in full


def to_toml(config: Config, without: Container[str] = ()) -> str:
    """A TOML file that loads as `config`, with every key's meaning, unit and range as comments.

    The keys `without`, as `section.key`, are left to their defaults.
    """
    lines = ["# Configuration of quadriga. Every key may be left out: its default then holds."]
    for section, values in _sections(config):
        lines += ["", "# " + values.__doc__.partition("\n")[0], f"[{section}]"]
        for item in fields(values):
            if f"{section}.{item.name}" not in without:
                unit, limits = _unit(item.metadata), _limits(item.metadata)
                about = item.metadata["doc"] + (f" [{unit}]" if unit else "")
                lines.append(f"# {about}; {limits}" if limits else f"# {about}")
                lines.append(f"{item.name} = {_toml(getattr(values, item.name))}")
    return "\n".join(lines) + "\n"


def to_markdown(config: Config) -> str:
    """Tables of every key with its default, unit, range and meaning."""
    lines = [
        "# Configuration",
        "",
        "One TOML file, read with `--config FILE`; every key may be left out. `quadriga config`",
        "prints the configuration in force as such a file. This page is generated:",
        "`quadriga config --markdown > docs/configuration.md`.",
    ]
    for section, values in _sections(config):
        lines += ["", f"## `[{section}]`", "", values.__doc__.partition("\n")[0], ""]
        lines += ["| key | default | unit | permitted | meaning |", "|---|---|---|---|---|"]
        for item in fields(values):
            meta, default = item.metadata, f"`{_toml(getattr(values, item.name))}`"
            cells = (f"`{item.name}`", default, _unit(meta), _limits(meta), meta["doc"])
            lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines) + "\n"


def _sections(config: Config) -> Iterator[tuple[str, Any]]:
    return ((section.name, getattr(config, section.name)) for section in fields(config))


def config_sha256(config: Config) -> str:
    """Hash of all values; equal configurations have equal hashes, however they were written.

    How the processes reach each other (`bus`) is left out: it does not change what they do, and
    every walk takes a free port.
    """
    values = {name: value for name, value in asdict(config).items() if name != "bus"}
    canonical = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def agreed_keys(config: Config) -> tuple[str, ...]:
    """`section.key=value` of every key that all processes of a team must agree on, sorted.

    Values are JSON; of one longer than 80 characters, such as a trace, a digest is told instead.
    """
    found = list[str]()
    for section, keys in asdict(config).items():
        for key, value in keys.items():
            name, text = f"{section}.{key}", json.dumps(value)
            if len(text) > _LONGEST:
                text = f"sha256:{hashlib.sha256(text.encode()).hexdigest()[:16]}"
            if name in _AGREED or not (section in _OWN_SECTIONS or name in _OWN):
                found.append(f"{name}={text}")
    return tuple(sorted(found))


def departures(config: Config, usual: Config) -> Iterator[tuple[str, Any, Any, Mapping[str, Any]]]:
    """Keys whose values differ, but for `bus`: `section.key`, value, usual one, key's metadata."""
    for section, mine in _sections(config):
        for item in fields(mine) if section != "bus" else ():
            value, other = (getattr(of, item.name) for of in (mine, getattr(usual, section)))
            if value != other:
                yield f"{section}.{item.name}", value, other, item.metadata


def _unit(meta: Mapping[str, Any]) -> str:
    return "" if meta["unit"] in ("-", "1") else str(meta["unit"])


def _limits(meta: Mapping[str, Any]) -> str:
    if meta["choices"]:
        more = f", or {meta['more']}" if meta["more"] else ""
        return f"one of {', '.join(meta['choices'])}{more}"
    low, high = meta["low"], meta["high"]
    if high < inf:
        return f"{low:.10g} … {high:.10g}"
    return f"≥ {low:g}" if low > -inf else ""


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_toml(item) for item in value)}]"
    # JSON's texts and truth values are TOML's; its numbers are not, as 1e+16.
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (bool, str)) else repr(value)
