"""References that change no faster than an operator of this team asks for.

Whoever reaches the bus may ask for any speed within the limits, but not jump between them: a team
that is sent to and fro ten times a second falls.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

import numpy as np

from quadriga.agents.planning.operator_references import remember_references
from quadriga.shared.config.reference_trace import trace_of
from quadriga.shared.config.sections import Config, ReferenceConfig
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Reference
from quadriga.shared.robots.conventions import Array
from quadriga.shared.topics import REFERENCE_EPOCH_MS

_NAMES: Final = ("vx", "vy", "wz", "height")
_SHARE: Final = 0.1  # of the range of what may be asked for, in an epoch: all of it in a second
_ROUNDING: Final = 1e-9


class ReferenceSlew:
    """Limits each reference by those before it; what the configured operator sends stays as it is.

    References must be given in the order in which the agent takes them in, so that a replay does
    the same.
    """

    def __init__(self, config: Config) -> None:
        self._most = most_change(config) + _ROUNDING
        self._known: tuple[Reference, ...] = ()

    def limit(self, reference: Reference) -> Reference:
        """The reference, or the nearest to it that the one before it allows.

        The first is believed: an agent may have been started while the team walks.
        """
        reference = self.limit_after(self._known, reference)
        self._known = remember_references(self._known, (reference,), reference.tick)
        return reference

    def limit_after(self, known: tuple[Reference, ...], reference: Reference) -> Reference:
        """Likewise, where those that are `known` came before it."""
        before = next((r for r in reversed(known) if r.tick <= reference.tick), None)
        return reference if before is None else self._approach(before, reference)

    def _approach(self, before: Reference, asked: Reference) -> Reference:
        epochs = max(1.0, (asked.tick - before.tick) / REFERENCE_EPOCH_MS)
        changes: dict[str, Any] = {}
        for name, most in zip(_NAMES, (epochs * self._most).tolist(), strict=True):
            start, wanted = getattr(before, name), getattr(asked, name)
            if abs(wanted - start) > most:
                changes[name] = start + (most if wanted > start else -most)
        return replace(asked, **changes) if changes else asked


def most_change(config: Config) -> Array:
    """By how much vx, vy, wz and height may change from one epoch to the next. Shape (4,).

    It is a share of the range that they have, or what the configured operator changes, if that is
    more: at the end of a trace, for example, that begins anew.
    """
    keys = [ReferenceConfig.__dataclass_fields__[name].metadata for name in _NAMES]
    share = np.array([_SHARE * (key["high"] - key["low"]) for key in keys])
    most: Array = np.maximum(share, _configured_change(config))
    return most


def _configured_change(config: Config) -> Array:
    """The most that the configured operator changes from one epoch to the next. Shape (4,)."""
    asked, trace = config.reference, None
    with suppress(ConfigError):  # a file that this computer lacks: the operator has it
        trace = trace_of(config)
    epoch = 1e-3 * REFERENCE_EPOCH_MS
    begun = epoch / max(asked.ramp, epoch)  # share of full speed that the ramp adds
    change = np.zeros(4)
    if trace is None:
        change[:3] = begun * np.abs([asked.vx, asked.vy, asked.wz])
        return change
    slopes = np.abs(np.diff(trace.v, axis=0) / np.diff(trace.t)[:, None]).max(axis=0)
    anew = np.abs(trace.v[-1] - trace.v[0])
    change[:3] = epoch * slopes + anew + begun * np.abs(trace.v).max(axis=0)
    return change
