"""Messages of some keys, live from the bus or from a recording, for whoever wants to look at them.

Nobody waits for a listener: it is no member of the team.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Final

from quadriga.recordings.key_patterns import KeyPattern, key_patterns
from quadriga.recordings.readable import open_readable
from quadriga.shared.bus.session import POLL, Bus
from quadriga.shared.codec import envelope
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.link.ticks import gathered
from quadriga.shared.recording.reader import ChunkEntry
from quadriga.shared.runtime.clock import log_ns, monotonic
from quadriga.shared.topics import TICKS

_PATIENCE: Final = 3.0  # s wall without a message after which a listener is shown where it listens


def entries_from_file(path: Path, keys: Sequence[str]) -> Generator[ChunkEntry]:
    """The recorded messages of `keys` (none: all); of a damaged file what is readable.

    Raises:
        RecordingError: at once if nothing can be read, at the end if the file is damaged or
            has none of these keys.
        ConfigError: something is not a key.
    """
    source, error = open_readable(path)
    patterns = key_patterns(keys, source.metadata.get("team", Config().team.name), "KEY")
    chosen: dict[str, bool] = {}
    for entry in source.entries():
        if entry.key not in chosen:
            chosen[entry.key] = _matches(patterns, entry.key)
        if chosen[entry.key]:
            yield entry
    if error is not None:
        raise error
    if keys and not any(chosen.values()):
        known = ", ".join(sorted(chosen)) or "no message at all"
        raise RecordingError(str(path), f"no key that fits {' '.join(keys)}", f"some of {known}")


def entries_from_bus(
    config: Config,
    name: str,
    keys: Sequence[str],
    stopped: Callable[[], bool],
    say: Callable[[str], None],
) -> Generator[ChunkEntry | None]:
    """What is published on `keys` (none: all) until `stopped()`; None whenever nothing is there.

    Raises:
        BusError: the bus cannot be opened.
        ConfigError: something is not a key.
    """
    team, begun = config.team.name, monotonic()
    silent = True
    patterns = key_patterns(keys, team, "KEY")
    with Bus.open(config.bus, team, f"{name}-{os.getpid()}", stopped) as bus:
        expression = patterns[0].expression if len(patterns) == 1 else f"{team}/**"
        bus.subscribe(expression)
        if expression != f"{team}/**" and expression != (ticks := TICKS.key(team, "*")):
            bus.subscribe(ticks)  # of which states and commands are taken out
        while not stopped():
            first = bus.get(POLL)
            if first is None:
                if silent and monotonic() - begun > _PATIENCE:
                    silent = False
                    say(_format_silence(bus, config, keys))
                yield None
                continue
            silent, now = False, log_ns()
            for key, payload in (first, *bus.drain()):
                if _matches(patterns, key):
                    head = envelope(payload)
                    yield ChunkEntry(key, -1 if head is None else head[0], now, payload)
                if key.endswith(f"/{TICKS.name}"):
                    for item in gathered(key, payload):
                        if _matches(patterns, item.key):
                            yield ChunkEntry(item.key, item.tick, item.log_ns, item.payload)


def _matches(patterns: Sequence[KeyPattern], key: str) -> bool:
    return not patterns or any(pattern.matches(key) for pattern in patterns)


def _format_silence(bus: Bus, config: Config, keys: Sequence[str]) -> str:
    who = "linked to others" if bus.linked else "linked to nobody"
    return (
        f"nothing yet of {', '.join(keys) or 'any key'} of team {config.team.name!r} at "
        f"{config.bus.endpoint}, {who} (--config RUN/config.toml says where a walk is)"
    )
