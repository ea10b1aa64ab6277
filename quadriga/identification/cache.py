"""Where data and predictors are kept between runs, and the keys they are kept under."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from quadriga.identification.behaviour import behaviour
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.places import cache_file

_LOOK: Final = 0.2  # s, between two looks for a file that another process writes
# What a recorded walk rests on besides this project's code.
_LIBRARIES: Final = ("mujoco", "pin", "numpy", "numba", "daqp", "example-robot-data")
# Keys of the identification that the walks do not depend on, only what is made of them.
_FITTED: Final = (
    "preset", "predictor", "neighbours", "ridge", "block_weight", "max_radius", "max_peers_harm",
    "gain_range", "response",
)  # fmt: skip


def data_key(config: Config) -> str:
    """Key of the collected data: everything a collected walk depends on."""
    team, planner = asdict(config.team), asdict(config.planner)
    ident = {k: v for k, v in asdict(config.identification).items() if k not in _FITTED}
    horizon = ("T_ini", "N") if config.identification.seconds == 0 else ()
    sections: dict[str, Any] = {
        "robot": asdict(config.robot),
        "team": {k: team[k] for k in ("robots", "robot", "yokes", "spacing", "alternate_phase")},
        "sensors": asdict(config.sensors),
        "motors": asdict(config.motors),
        "estimator": asdict(config.estimator),
        "gait": asdict(config.gait),
        "controller": asdict(config.controller),
        "reference": {"height": config.reference.height},
        "planner": {k: planner[k] for k in ("interface", *horizon)},
        "identification": ident,
    }
    code = behaviour("quadriga.identification.sample_collection")
    libraries = {name: version(name) for name in _LIBRARIES}
    return _digest([sections, code, libraries])


def predictor_key(config: Config) -> str:
    """Key of the fitted predictor: its data, the fit's settings and the fit's code.

    The planner's weights are not in it: they change no fit, and a radius of other weights than
    those that a predictor was kept with is computed when it is loaded.
    """
    planner, ident = asdict(config.planner), asdict(config.identification)
    if config.response_file:
        ident["response"] = _file_digest(Path(config.response_file))
    sections: dict[str, Any] = {
        "identification": ident,
        "planner": {k: planner[k] for k in ("N", "T_ini", "interface")},
    }
    code = behaviour("quadriga.identification.sample_fits")
    return _digest([data_key(config), sections, code])


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
                "`quadriga prepare` makes it; from another configuration, code "
                "or kind of machine it has another name",
            )
        sleep(_LOOK)


def _file_digest(path: Path) -> str:
    """Digest of what is in a file of responses; of nothing if it is not there yet."""
    content = path.read_bytes() if path.is_file() else b""  # whoever fits complains
    return hashlib.sha256(content).hexdigest()


def _digest(parts: list[Any]) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]
