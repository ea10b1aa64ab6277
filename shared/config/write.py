"""`Config` → text: a commented TOML file, a table for the documentation, a hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Container, Iterator, Mapping
from dataclasses import asdict, fields
from typing import Any

from quadriga.shared.config.sections import Config


def to_toml(config: Config, without: Container[str] = ()) -> str:
    """A TOML file that loads as `config`, with every key's meaning, unit and range as comments.

    The keys `without`, as `section.key`, are left to their defaults.
    """
    lines = ["# Configuration of quadriga. Every key may be left out: its default then holds."]
    for section in fields(config):
        values = getattr(config, section.name)
        lines += ["", f"# {_summary(values)}", f"[{section.name}]"]
        for item in fields(values):
            if f"{section.name}.{item.name}" in without:
                continue
            doc, unit, limits = item.metadata["doc"], _unit(item.metadata), _limits(item.metadata)
            lines.append(f"# {doc}{f' [{unit}]' if unit else ''}{f'; {limits}' if limits else ''}")
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
    for section in fields(config):
        values = getattr(config, section.name)
        lines += ["", f"## `[{section.name}]`", "", _summary(values), ""]
        lines += ["| key | default | unit | permitted | meaning |", "|---|---|---|---|---|"]
        for item in fields(values):
            meta = item.metadata
            default = f"`{_toml(getattr(values, item.name))}`"
            cells = [f"`{item.name}`", default, _unit(meta), _limits(meta), meta["doc"]]
            lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines) + "\n"


def config_sha256(config: Config) -> str:
    """Hash of all values; equal configurations have equal hashes, however they were written.

    How the processes reach each other (`bus`) is left out: it does not change what they do, and
    every walk takes a free port.
    """
    values = {name: value for name, value in asdict(config).items() if name != "bus"}
    canonical = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def departures(config: Config, usual: Config) -> Iterator[tuple[str, Any, Any, Mapping[str, Any]]]:
    """Keys whose values differ: `section.key`, value, the usual one, the key's metadata.

    How the processes reach each other (`bus`) changes nothing that they do and is left out.
    """
    for section in fields(config):
        mine, theirs = getattr(config, section.name), getattr(usual, section.name)
        for item in fields(mine):
            value, other = getattr(mine, item.name), getattr(theirs, item.name)
            if value != other and section.name != "bus":
                yield f"{section.name}.{item.name}", value, other, item.metadata


def _summary(section: Any) -> str:
    return (section.__doc__ or "").strip().splitlines()[0]


def _unit(meta: Any) -> str:
    return "" if meta["unit"] in ("-", "1") else str(meta["unit"])


def _limits(meta: Any) -> str:
    if meta["choices"]:
        more = f", or {meta['more']}" if meta["more"] else ""
        return f"one of {', '.join(meta['choices'])}{more}"
    low, high = meta["low"], meta["high"]
    if low is None:
        return "" if high is None else f"≤ {high:g}"
    return f"≥ {low:g}" if high is None else f"{low:.10g} … {high:.10g}"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return repr(value)
