"""Predictor files: nothing is lost, what is broken or changed is refused."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, predictor_sha256, read, save
from quadriga.shared.errors import PredictorError


def test_what_is_saved_is_read(stored: Path, fitted: tuple[Predictor, Provenance]) -> None:
    predictor, provenance = read(stored)
    assert predictor.G.tobytes() == fitted[0].G.tobytes()
    assert predictor.meta == fitted[0].meta
    assert provenance == fitted[1]
    assert {"python", "numpy", "scipy"} <= provenance.versions.keys()
    assert list(stored.parent.iterdir()) == [stored]


def test_the_digest_is_of_the_content(tmp_path: Path, fitted: tuple[Predictor, Provenance]) -> None:
    predictor, provenance = fitted
    elsewhere = replace(provenance, config_digest="another machine")
    digests = {save(tmp_path / name, predictor, elsewhere) for name in ("a.npz", "b.npz")}
    assert digests == {predictor_sha256(predictor)}
    assert read(tmp_path / "a.npz")[1].config_digest == "another machine"
    nudged = predictor.G.copy()
    nudged[0, 0, 1, 2, 3] = np.nextafter(nudged[0, 0, 1, 2, 3], np.inf)
    assert predictor_sha256(Predictor(predictor.meta, nudged)) not in digests
    other = replace(predictor.meta, stance_ms=150)
    assert predictor_sha256(Predictor(other, predictor.G)) not in digests


def test_a_missing_file_tells_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(PredictorError, match=r"got no such file.*`quadriga fit`"):
        read(tmp_path / "none.npz")


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 not really", b"\x93NUMPY\x01\x00"])
def test_a_file_that_is_no_predictor(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        read(path)


def test_a_directory_is_no_predictor(tmp_path: Path) -> None:
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        read(tmp_path)


def test_an_archive_of_something_else(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", A=np.eye(3))
    with pytest.raises(PredictorError, match="KeyError"):
        read(tmp_path / "x.npz")
    np.savez(tmp_path / "y.npz", G=np.eye(3), document=np.array("[1, 2]"))
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        read(tmp_path / "y.npz")


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.95, 0.999])
def test_a_truncated_file(stored: Path, kept: float) -> None:
    content = stored.read_bytes()
    stored.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(PredictorError, match="truncated or not a predictor"):
        read(stored)


def rewritten(stored: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """The same file with another document, as someone with an editor would leave it."""
    with np.load(stored) as archive:
        G, document = archive["G"], json.loads(str(archive["document"]))
    change(document)
    np.savez(stored, G=G, document=np.array(json.dumps(document)))
    return stored


def test_content_that_was_changed(stored: Path) -> None:
    path = rewritten(stored, lambda document: document["meta"].update(stance_ms=150))
    with pytest.raises(PredictorError, match="digest does not match"):
        read(path)


def test_another_format(stored: Path) -> None:
    path = rewritten(stored, lambda document: document.update(format=1))
    with pytest.raises(PredictorError, match="got format 1, expected format 2"):
        read(path)


def test_a_predictor_without_gates(stored: Path) -> None:
    path = rewritten(stored, lambda document: document["provenance"].update(gates={}))
    with pytest.raises(PredictorError, match="expected a predictor that quadriga wrote"):
        read(path)


def test_a_place_that_cannot_be_written(
    tmp_path: Path, fitted: tuple[Predictor, Provenance]
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(PredictorError, match="expected a file that can be written"):
        save(tmp_path / "file" / "predictor.npz", *fitted)


def test_the_file_is_an_ordinary_archive(stored: Path) -> None:
    assert sorted(zipfile.ZipFile(stored).namelist()) == ["G.npy", "document.npy"]


def test_keys_of_the_controller_keep_their_first_names_in_the_file(
    fitted: tuple[Predictor, Provenance],
) -> None:
    """A new name of a key must not make every predictor another one."""
    meta = fitted[0].meta
    body = meta.to_dict()
    assert "mu_least" in body["controller"]
    assert "mu_min" not in body["controller"]
    assert PredictorMeta.from_dict(body) == meta
