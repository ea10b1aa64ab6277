"""Predictor files: what a predictor is made of, what it was fitted for, and where it comes from."""

from __future__ import annotations

import hashlib
import json
import platform
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.periodic import FACTORS, PeriodicFactors
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.errors import PredictorError, PredictorFileError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

FORMAT: Final = 3
_PACKAGES: Final = ("quadriga", "numpy", "scipy", "mujoco", "pin", "daqp")
REMEDY: Final = "fit one with `quadriga fit`"


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
    head = [predictor.meta.to_dict(), *(array.shape for array in arrays)]
    digest = hashlib.sha256(json.dumps(head, sort_keys=True).encode() + b"\0")
    for array in arrays:
        digest.update(array.data)
    return digest.hexdigest()


def save(path: Path, predictor: Predictor, provenance: dict[str, Any] | None = None) -> str:
    """Write a predictor file; a file half written never has the name `path`.

    Args:
        path: of the file.
        predictor: of any plant.
        provenance: where it comes from, as JSON can carry it; see `gates.Provenance`.

    Returns:
        The predictor's digest (`predictor_sha256`).

    Raises:
        PredictorFileError: the file cannot be written.
    """
    digest, meta = predictor_sha256(predictor), predictor.meta.to_dict()
    document = {"format": FORMAT, "sha256": digest, "meta": meta, "provenance": provenance}
    with name_file_errors(PredictorFileError, path, "a file that can be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as partial, partial.open("wb") as file:
            text = np.array(json.dumps(document, sort_keys=True))
            np.savez(file, allow_pickle=False, document=text, **predictor.arrays())
    return digest


def load(path: Path) -> tuple[Predictor, Any]:
    """A predictor of `save`, whatever it was fitted for, and where it comes from.

    Raises:
        PredictorFileError: no such file, not a predictor, another format, or corrupt.
    """
    try:
        with open_npz(path) as archive:
            document = json.loads(str(archive["document"]))
            names = ("G",) if "G" in archive.files else FACTORS
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in names}
        found, sha256, provenance = (document[k] for k in ("format", "sha256", "provenance"))
        if found != FORMAT:
            raise PredictorFileError(
                f"predictor {path}", f"format {found}", f"format {FORMAT}", REMEDY
            )
        parts = arrays["G"] if "G" in arrays else PeriodicFactors(**arrays)
        predictor = Predictor(PredictorMeta.from_dict(document["meta"]), parts)
        unchanged = sha256 == predictor_sha256(predictor)
    except FileNotFoundError:
        raise PredictorFileError(f"predictor {path}", "no such file", "a file", REMEDY) from None
    except PredictorFileError:
        raise
    except (*UNREADABLE, PredictorError) as error:
        raise not_a_predictor(path, error) from None
    if not unchanged:
        raise PredictorFileError(
            f"predictor {path}",
            "content that its digest does not match",
            "an unchanged file",
            f"corrupt: delete it; {REMEDY}",
        )
    return predictor, provenance


def not_a_predictor(path: Path, error: Exception) -> PredictorFileError:
    """What to raise of a file whose bytes cannot be what `save` wrote."""
    return PredictorFileError(
        f"predictor {path}",
        f"something else ({type(error).__name__})",
        "a predictor that quadriga wrote",
        f"truncated or not a predictor: delete it; {REMEDY}",
    )
