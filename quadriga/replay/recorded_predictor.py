"""The predictor a recorded team walked with: beside the recording, or in the user's cache."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Final

from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import load, predictor_sha256
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, RecordingError, name_file_errors
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.npz import UNREADABLE, open_npz
from quadriga.shared.runtime.places import cache_dir, cache_files

PREDICTOR: Final = "predictor.npz"  # its name in a run folder


def copy_predictor(predictor: Path, run_dir: Path) -> None:
    """Put a predictor beside the recording, so that a run folder is all a replay needs.

    Raises:
        RecordingError: it cannot be written.
    """
    target = run_dir / PREDICTOR
    with name_file_errors(RecordingError, target, "room for the predictor"):
        target.unlink(missing_ok=True)
        shutil.copyfile(predictor, target)


def find_predictor(
    recording: Recording, config: Config, given: Path | None
) -> tuple[Predictor | None, bool]:
    """The predictor of a recorded walk's agents, and whether it is the one they had.

    Args:
        recording: of the walk.
        config: its configuration.
        given: a file to take instead.

    Raises:
        PredictorError: the agents had one, and it is nowhere; or `given` is none.
    """
    if not find_kind(config.planner.kind).agents_predict:
        if given is not None:
            raise PredictorError(
                f"--predictor {given}",
                f"planner.kind {config.planner.kind!r}",
                "agents that plan for themselves",
                "the recorded ones had no predictor",
            )
        return None, True
    sha256 = recording.metadata.get("predictor_sha256", "")
    if given is not None:
        predictor = load(given)[0]
        return predictor, not sha256 or predictor_sha256(predictor) == sha256
    return _find_kept(recording), True


def read_recorded(recording: Recording, config: Config) -> Predictor:
    """The predictor that a recorded team walked with, whoever of it planned.

    Raises:
        PredictorError: its planner needs none, or it is nowhere.
    """
    if not find_kind(config.planner.kind).needs_predictor:
        raise PredictorError(
            f"predictor of {recording.path}",
            f"planner.kind {config.planner.kind!r}",
            "a planner that predicts",
            "the team walked without",
        )
    return _find_kept(recording)


def _find_kept(recording: Recording) -> Predictor:
    """The predictor beside a recording, or in the cache, that has the recorded digest.

    Raises:
        PredictorError: it is nowhere.
    """
    sha256 = recording.metadata.get("predictor_sha256", "")
    beside = recording.path.parent / PREDICTOR
    for path in (beside, *cache_files("predictor")):
        if sha256 and _read_digest(path) == sha256:
            return load(path)[0]
    wanted = f"with digest {sha256[:16]}…" if sha256 else "of unknown digest"
    raise PredictorError(
        f"predictor of {recording.path}",
        f"none in {beside.parent} or {cache_dir()}",
        f"the one the team walked with, {wanted}",
        "give it with --predictor FILE: `quadriga walk` leaves it in its run folder as "
        f"{PREDICTOR}",
    )


def _read_digest(path: Path) -> str:
    """The digest that is written in a predictor file; "" if it is none."""
    try:
        with open_npz(path) as archive:
            return str(json.loads(str(archive["document"]))["sha256"])
    except UNREADABLE:
        return ""
