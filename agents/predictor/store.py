"""Predictor files: G, what it was fitted for, its provenance, and the figures of its gates."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.gates import GateReport
from quadriga.agents.predictor.periodic_predictor import FACTORS, PeriodicFactors, PeriodicPredictor
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.errors import PredictorFileError, name_file_errors
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

FORMAT: Final = 2
_PACKAGES: Final = ("quadriga", "numpy", "scipy", "mujoco", "pin", "daqp")
REMEDY: Final = "fit one with `quadriga fit`"


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a predictor comes from.

    Attributes:
        config_digest: of the configuration that the data were collected with.
        seeds: of the training episodes.
        samples: of each training episode, at 100 Hz.
        held_out: samples of each episode held out.
        versions: of the packages that took part.
        gates: figures of its gates.
    """

    config_digest: str
    seeds: tuple[int, ...]
    samples: tuple[int, ...]
    held_out: tuple[int, ...]
    versions: Mapping[str, str]
    gates: GateReport

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> Provenance:
        """The inverse of `asdict`, also after JSON has made lists of tuples."""
        frozen: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in body.items()
        }
        return cls(**frozen | {"gates": GateReport.from_dict(body["gates"])})


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a fit depends on."""
    installed = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            installed[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            installed[package] = "not installed"
    return installed


def predictor_sha256(predictor: Predictor) -> str:
    """Digest of G and its meta: equal predictors have equal digests, however they were stored."""
    arrays = [np.ascontiguousarray(array, dtype="<f8") for array in predictor.arrays().values()]
    head = json.dumps(
        [predictor.meta.to_dict(), *(array.shape for array in arrays)], sort_keys=True
    )
    content = b"".join(array.tobytes() for array in arrays)
    return hashlib.sha256(head.encode() + b"\0" + content).hexdigest()


def save(path: Path, predictor: Predictor, provenance: Provenance) -> str:
    """Write a predictor file; a file half written never has the name `path`.

    Returns:
        The predictor's digest (`predictor_sha256`).

    Raises:
        PredictorFileError: the file cannot be written.
    """
    digest = predictor_sha256(predictor)
    document = {
        "format": FORMAT,
        "sha256": digest,
        "meta": predictor.meta.to_dict(),
        "provenance": asdict(provenance),
    }
    with name_file_errors(PredictorFileError, path, "a file that can be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as partial, partial.open("wb") as file:
            text = np.array(json.dumps(document, sort_keys=True))
            np.savez(file, allow_pickle=False, document=text, **predictor.arrays())
    return digest


def read(path: Path) -> tuple[Predictor, Provenance]:
    """Read a predictor file whatever it was fitted for (to show what is in it).

    Raises:
        PredictorFileError: no such file, not a predictor, or corrupt.
    """
    try:
        with open_npz(path) as archive:
            document = json.loads(str(archive["document"]))
            names = FACTORS if "response" in archive.files else ("G",)
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in names}
        if document["format"] != FORMAT:
            raise PredictorFileError(
                f"predictor {path}", f"format {document['format']}", f"format {FORMAT}", REMEDY
            )
        meta = PredictorMeta.from_dict(document["meta"])
        provenance = Provenance.from_dict(document["provenance"])
        predictor = _build(meta, arrays, provenance.gates.condition)
        unchanged = document["sha256"] == predictor_sha256(predictor)
    except FileNotFoundError:
        raise PredictorFileError(f"predictor {path}", "no such file", "a file", REMEDY) from None
    except UNREADABLE as error:
        raise PredictorFileError(
            f"predictor {path}",
            f"something else ({type(error).__name__})",
            "a predictor that quadriga wrote",
            f"truncated or not a predictor: delete it; {REMEDY}",
        ) from None
    if not unchanged:
        raise PredictorFileError(
            f"predictor {path}",
            "content that its digest does not match",
            "an unchanged file",
            f"corrupt: delete it; {REMEDY}",
        )
    return predictor, provenance


def _build(meta: PredictorMeta, arrays: dict[str, Array], condition: float | None) -> Predictor:
    if "G" in arrays:
        return Predictor(meta, arrays["G"], condition)
    return PeriodicPredictor(meta, PeriodicFactors(**arrays), condition)
