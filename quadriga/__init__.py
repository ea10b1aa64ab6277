"""Teams of yoked quadrupeds that walk as one, each planned by its own process from data.

What a script of one's own needs is here:

>>> run = quadriga.walk("hard-blocks", seed=7, seconds=10)
>>> print(run.summary["fallen"], run["r1/state"]["q_joint"].shape)

Each name is imported when it is first asked for: every process of a team imports this package, and
none of them needs these. `__init__.pyi` has the same names with their types.
"""

from __future__ import annotations

# Of each name the module that has it. They are text: what imports this package does not depend on
# them, neither at its start nor in the digest of its code.
_HOMES = {
    "BusError": "quadriga.shared.errors",
    "Config": "quadriga.shared.config.sections",
    "ConfigError": "quadriga.shared.errors",
    "PairedComparison": "quadriga.api.paired",
    "PredictorError": "quadriga.shared.errors",
    "ProcessError": "quadriga.shared.errors",
    "QuadrigaError": "quadriga.shared.errors",
    "RecordingError": "quadriga.shared.errors",
    "ReplayResult": "quadriga.api.replayed",
    "Run": "quadriga.api.run",
    "TopicArrays": "quadriga.api.topic_arrays",
    "TopicField": "quadriga.api.topic_arrays",
    "TrackingArrays": "quadriga.api.tracking_arrays",
    "compare_paired": "quadriga.api.paired",
    "load_config": "quadriga.api.configuration",
    "open": "quadriga.api.run",
    "read_trials": "quadriga.api.paired",
    "walk": "quadriga.api.walking",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    """Import what is asked for."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found = globals()[name] = getattr(import_module(home), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
