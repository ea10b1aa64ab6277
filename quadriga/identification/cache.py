"""Where data and predictors are kept between runs, and the keys they are kept under."""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import quadriga
from quadriga import agents, shared, sim_server
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.places import cache_file

_LOOK = 0.2  # s, between two looks for a file that another process writes
# What a recorded walk depends on: the code of the world and of the agent, and what they rest on.
_LIBRARIES = ("mujoco", "pin", "numpy", "numba", "daqp", "example-robot-data")
_CODE = (
    (shared, ("**/*",)),
    (agents, ("**/*",)),
    (sim_server, ("**/*",)),
    (quadriga, ("identification/collect.py", "identification/rollout.py")),
)
# What a trial's figures depend on besides its configuration and predictor.
_TRIAL_CODE = (
    *_CODE,
    (
        quadriga,
        (
            "experiments/trial/*.py",
            "team/operator.py",
            "recordings/summary.py",
            "recordings/traces.py",
            "recordings/truth.py",
        ),
    ),
)
_FIT_CODE = ((agents, ("predictor/*", "planner/*")),)
# Keys of the identification that the walks do not depend on, only what is made of them.
_FITTED = (
    "predictor", "neighbours", "phases", "phase_ridge", "ridge", "block_weight", "max_radius",
    "gain_range",
)  # fmt: skip


def data_key(config: Config) -> str:
    """Key of the collected data: everything a collected walk depends on."""
    ident = asdict(config.identification)
    for fitted in _FITTED:
        del ident[fitted]
    parts: dict[str, Any] = {
        "robots": config.team.robots, "yokes": config.team.yokes, "spacing": config.team.spacing,
        "alternate_phase": config.team.alternate_phase,
        "sensors": asdict(config.sensors), "estimator": asdict(config.estimator),
        "gait": asdict(config.gait), "controller": asdict(config.controller),
        "height": config.reference.height, "interface": config.planner.interface,
        "horizon": [config.planner.T_ini, config.planner.N] if ident["seconds"] == 0 else [],
        "identification": ident, "code": _code_digest(_CODE),
        "libraries": {name: version(name) for name in _LIBRARIES},
    }  # fmt: skip
    return _digest(parts)


def predictor_key(config: Config) -> str:
    """Key of the fitted predictor: its data, the fit's settings and the fit's code."""
    planner = asdict(config.planner)
    return _digest(
        {
            "data": data_key(config),
            "identification": asdict(config.identification),
            "planner": {k: planner[k] for k in ("N", "T_ini", "applied", "Q", "R", "interface")},
            "code": _code_digest(_FIT_CODE),
        }
    )


def predictor_path(config: Config) -> Path:
    """Where the predictor of this configuration is kept."""
    return cache_file("predictor", predictor_key(config))


def data_path(config: Config) -> Path:
    """Where the collected data of this configuration are kept."""
    return cache_file("data", data_key(config))


def await_predictor(path: Path, timeout: float) -> None:
    """Wait until another process has written the predictor file `path`.

    Raises:
        PredictorError: there was none after `timeout` seconds.
    """
    deadline = monotonic() + timeout
    while not path.is_file():
        if monotonic() > deadline:
            raise PredictorError(
                f"predictor {path}",
                f"no such file after {timeout:g} s",
                "a file",
                "`quadriga prepare` makes it; from another configuration or version of the code "
                "it has another name",
            )
        sleep(_LOOK)


@lru_cache(maxsize=1)
def trial_code() -> str:
    """Digest of the code that a trial's figures depend on."""
    return _code_digest(_TRIAL_CODE)[:16]


def _digest(parts: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def _code_digest(packages: Iterable[tuple[Any, tuple[str, ...]]]) -> str:
    """Digest of the syntax trees: a changed comment or layout does not cost a new collection."""
    digest = hashlib.sha256()
    for package, patterns in packages:
        root = Path(package.__file__).parent
        for pattern in patterns:
            for path in sorted(root.glob(pattern)):
                if path.suffix == ".py":
                    tree = ast.parse(path.read_text(encoding="utf-8"))
                    digest.update(f"{path.name}{ast.dump(tree)}".encode())
    return digest.hexdigest()
