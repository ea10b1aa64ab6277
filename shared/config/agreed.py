"""The keys of the configuration that all processes of a team must agree on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from typing import Final

from quadriga.shared.config.sections import Config

# Sections that are a computer's own: where it is reached, how it runs programs, where it writes.
_OWN_SECTIONS: Final = frozenset({"bus", "runtime", "recorder"})
# What of them the whole team rests on: who waits for whom, and for how long.
_AGREED: Final = frozenset({"bus.clock_timeout", "recorder.enabled"})
# Single keys that are a computer's own: names of files, a label, where a robot hangs. What is in
# the files is part of the predictor.
_OWN_KEYS: Final = frozenset(
    {
        "world.scenario",
        "identification.response",
        "bridge.endpoint",
        "bridge.listen",
        "bridge.interface",
        "bridge.domain",
    }
)
_LONGEST: Final = 80  # characters of a value that is told in full


def is_agreed(section: str, key: str) -> bool:
    """Whether all processes of a team must have the same value of this key."""
    name = f"{section}.{key}"
    return name in _AGREED or (section not in _OWN_SECTIONS and name not in _OWN_KEYS)


def agreed_keys(config: Config) -> tuple[str, ...]:
    """`section.key=value` of every key that must be the same, sorted; values are JSON.

    Of a value that is longer than 80 characters, such as a trace, a digest is told instead.
    """
    return tuple(
        sorted(
            f"{section}.{key}={_tell(value)}"
            for section, keys in asdict(config).items()
            for key, value in keys.items()
            if is_agreed(section, key)
        )
    )


def _tell(value: object) -> str:
    text = json.dumps(value)
    if len(text) <= _LONGEST:
        return text
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()[:16]}"
