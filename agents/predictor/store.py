"""Predictor files: what a predictor is made of, what it was fitted for, and where it comes from."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.gates import GateReport
from quadriga.agents.predictor.periodic import FACTORS, PeriodicFactors
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.errors import PredictorError, PredictorFileError, name_file_errors
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, open_npz

FORMAT: Final = 3
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
    return digest_of(predictor.meta.to_dict(), predictor.arrays())


def save(path: Path, predictor: Predictor, provenance: Provenance) -> str:
    """Write a predictor file; a file half written never has the name `path`.

    Returns:
        The predictor's digest (`predictor_sha256`).

    Raises:
        PredictorFileError: the file cannot be written.
    """
    meta, about = predictor.meta.to_dict(), {"provenance": asdict(provenance)}
    return write_archive(path, meta, predictor.arrays(), about)


def read(path: Path) -> tuple[Predictor, Provenance]:
    """Read a predictor file whatever it was fitted for (to show what is in it).

    Raises:
        PredictorFileError: no such file, not a predictor of a team, or corrupt.
    """
    meta, arrays, about = read_archive(path)
    with name_damage(path):
        provenance = Provenance.from_dict(about["provenance"])
        parts: Array | PeriodicFactors
        if "G" in arrays:
            parts = arrays["G"]
        else:
            parts = PeriodicFactors(**{name: arrays[name] for name in FACTORS})
        return Predictor(
            PredictorMeta.from_dict(meta), parts, provenance.gates.condition
        ), provenance


# ---- files of predictors, of teams and of any plant


def digest_of(meta: Mapping[str, Any], arrays: Mapping[str, Array]) -> str:
    """Digest of what a predictor was fitted for and of its arrays."""
    content = [np.ascontiguousarray(array, dtype="<f8") for array in arrays.values()]
    head = json.dumps([meta, *(array.shape for array in content)], sort_keys=True)
    return hashlib.sha256(
        head.encode() + b"\0" + b"".join(a.tobytes() for a in content)
    ).hexdigest()


def write_archive(
    path: Path, meta: dict[str, Any], arrays: Mapping[str, Array], about: dict[str, Any]
) -> str:
    """Write meta, arrays and what else is known; returns the digest of meta and arrays.

    Raises:
        PredictorFileError: the file cannot be written.
    """
    digest = digest_of(meta, arrays)
    document = {"format": FORMAT, "sha256": digest, "meta": meta, **about}
    with name_file_errors(PredictorFileError, path, "a file that can be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as partial, partial.open("wb") as file:
            text = np.array(json.dumps(document, sort_keys=True))
            np.savez(file, allow_pickle=False, document=text, **arrays)
    return digest


def read_archive(path: Path) -> tuple[dict[str, Any], dict[str, Array], dict[str, Any]]:
    """Meta, arrays and the whole document of a file of `write_archive`.

    Raises:
        PredictorFileError: no such file, another format, or corrupt.
    """
    with name_damage(path):
        with open_npz(path) as archive:
            document = json.loads(str(archive["document"]))
            names = [name for name in archive.files if name != "document"]
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in names}
        if document["format"] != FORMAT:
            raise PredictorFileError(
                f"predictor {path}", f"format {document['format']}", f"format {FORMAT}", REMEDY
            )
        unchanged = document["sha256"] == digest_of(document["meta"], arrays)
    if not unchanged:
        raise PredictorFileError(
            f"predictor {path}",
            "content that its digest does not match",
            "an unchanged file",
            f"corrupt: delete it; {REMEDY}",
        )
    return document["meta"], arrays, document


@contextmanager
def name_damage(path: Path) -> Iterator[None]:
    """Turn whatever damaged bytes raise into an error that names the file.

    Raises:
        PredictorFileError: no such file, or no predictor.
    """
    try:
        yield
    except PredictorFileError:
        raise
    except FileNotFoundError:
        raise PredictorFileError(f"predictor {path}", "no such file", "a file", REMEDY) from None
    except (*UNREADABLE, PredictorError) as error:
        raise PredictorFileError(
            f"predictor {path}",
            f"something else ({type(error).__name__})",
            "a predictor that quadriga wrote",
            f"truncated or not a predictor: delete it; {REMEDY}",
        ) from None
