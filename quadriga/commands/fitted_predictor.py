"""The predictor that a process of a team is started with."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind

if TYPE_CHECKING:
    from quadriga.agents.predictor.predictor import Predictor


def load_predictor(config: Config, arguments: argparse.Namespace) -> Predictor:
    """The predictor of `--predictor`, or this machine's for `config`, once it is there.

    Raises:
        PredictorError: there is none after `--wait` seconds, or it is not of this team.
    """
    from quadriga.agents.predictor.gates import load_checked
    from quadriga.identification.cache import await_predictor, predictor_path

    path = arguments.predictor or predictor_path(config)
    if arguments.wait:
        await_predictor(path, arguments.wait)
    return load_checked(path, config)[0]


def fitted_sha256(config: Config, wait: float) -> str:
    """Digest of this machine's predictor for `config`, "" if there is none.

    Raises:
        PredictorError: there is none after `wait` seconds, or it is not of this team.
    """
    if not find_kind(config.planner.kind).needs_predictor:
        return ""
    from quadriga.agents.predictor.gates import load_checked
    from quadriga.agents.predictor.store import predictor_sha256
    from quadriga.identification.cache import await_predictor, predictor_path

    path = predictor_path(config)
    if wait:
        await_predictor(path, wait)
    return predictor_sha256(load_checked(path, config)[0]) if path.is_file() else ""
