"""Files of fitted predictors."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.layout import Layout
from quadriga.data_driven.fitted_predictor import FittedPredictor
from quadriga.shared.errors import PredictorError, PredictorFileError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

_FORMAT: Final = "quadriga.data_driven 1"


def save(path: Path | str, predictor: FittedPredictor) -> None:
    """Write a predictor to a file of NumPy's; a file half written never has the name `path`.

    Raises:
        PredictorFileError: the file cannot be written.
    """
    path = Path(path)
    head = {
        "kind": predictor.kind,
        "layout": asdict(predictor.layout),
        "single": predictor.single,
        "condition": predictor.condition,
    }
    document = {"format": _FORMAT, "sha256": _digest(head, predictor.blocks), **head}
    with name_file_errors(PredictorFileError, path, "a file that can be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as partial, partial.open("wb") as file:
            text = np.array(json.dumps(document))
            np.savez(file, allow_pickle=False, document=text, blocks=predictor.blocks)


def load(path: Path | str) -> FittedPredictor:
    """Read a predictor of `save`.

    Raises:
        PredictorFileError: no such file, no predictor of `save`, or one that was damaged.
    """
    path = Path(path)
    try:
        with open_npz(path) as archive:
            document = json.loads(str(archive["document"]))
            blocks = np.ascontiguousarray(archive["blocks"], dtype=np.float64)
        if document.pop("format") != _FORMAT:
            raise ValueError("another format")
        digest = document.pop("sha256")
        predictor = FittedPredictor(
            document["kind"],
            _layout(document["layout"]),
            blocks,
            document["single"],
            document["condition"],
        )
    except FileNotFoundError:
        raise PredictorFileError(f"predictor {path}", "no such file", "a file") from None
    except (*UNREADABLE, PredictorError) as error:
        raise PredictorFileError(
            f"predictor {path}",
            f"something else ({type(error).__name__})",
            "a file that quadriga.data_driven.save wrote",
            "truncated, or a predictor of robots",
        ) from None
    if digest != _digest(document, blocks):
        raise PredictorFileError(
            f"predictor {path}", "content that its digest does not match", "an unchanged file"
        )
    return predictor


def _layout(body: dict[str, Any]) -> Layout:
    """The inverse of `asdict`, after JSON has made lists of tuples."""
    frozen: dict[str, Any] = {
        **body,
        "u_scale": tuple(body["u_scale"]),
        "y_scale": tuple(body["y_scale"]),
        "members": tuple(tuple(agents) for agents in body["members"]),
    }
    return Layout(**frozen)


def _digest(head: dict[str, Any], blocks: np.ndarray[Any, Any]) -> str:
    text = json.dumps(head, sort_keys=True)
    content = np.ascontiguousarray(blocks, dtype="<f8").tobytes()
    return hashlib.sha256(text.encode() + b"\0" + content).hexdigest()
