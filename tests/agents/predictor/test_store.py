"""Predictor files: nothing is lost, what is broken or changed is refused."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.gates import Provenance, read
from quadriga.agents.predictor.predictor import Predictor, fit_plant
from quadriga.agents.predictor.store import load, predictor_sha256, save
from quadriga.shared.errors import PredictorError
from tests.agents.predictor.plants import Sizes, random_plant, record

WRONG = "expected a predictor that quadriga wrote"


def test_a_predictor_of_any_plant_is_loaded_and_is_none_of_a_team(tmp_path: Path) -> None:
    sizes, path = Sizes(2, 1, 2, 3), tmp_path / "new" / "plant.npz"
    data = record(random_plant(sizes, 1), sizes, (200,), 2, 0.1)
    predictor = fit_plant(data, "ridge", 3, 4)
    digest = save(path, predictor)
    assert sorted(zipfile.ZipFile(path).namelist()) == ["G.npy", "document.npy"]
    assert list(path.parent.iterdir()) == [path]
    again, provenance = load(path)
    assert (again.meta, predictor_sha256(again), provenance) == (predictor.meta, digest, None)
    np.testing.assert_array_equal(again.G, predictor.G)
    with pytest.raises(PredictorError, match=WRONG):
        read(path)


def test_the_digest_is_of_the_content(tmp_path: Path, fitted: tuple[Predictor, Provenance]) -> None:
    predictor, provenance = fitted
    assert {"python", "numpy", "scipy"} <= provenance.versions.keys()
    elsewhere = asdict(replace(provenance, config_digest="another machine"))
    digests = {save(tmp_path / name, predictor, elsewhere) for name in ("a.npz", "b.npz")}
    assert digests == {predictor_sha256(predictor)}
    assert read(tmp_path / "a.npz")[1].config_digest == "another machine"
    nudged = predictor.G.copy()
    nudged[0, 0, 1, 2, 3] = np.nextafter(nudged[0, 0, 1, 2, 3], np.inf)
    assert predictor_sha256(Predictor(predictor.meta, nudged)) not in digests
    other = replace(predictor.meta, stance_ms=150)
    assert predictor_sha256(Predictor(other, predictor.G)) not in digests


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 not really", b"\x93NUMPY\x01\x00"])
def test_a_file_that_is_no_predictor(tmp_path: Path, content: bytes, stored: Path) -> None:
    path, whole = tmp_path / "x.npz", stored.read_bytes()
    path.write_bytes(content)
    stored.write_bytes(whole[: int(0.95 * len(whole))])
    np.savez(tmp_path / "y.npz", A=np.eye(3))
    np.savez(tmp_path / "z.npz", G=np.eye(3), document=np.array("[1, 2]"))
    for wrong in (path, stored, tmp_path, tmp_path / "y.npz", tmp_path / "z.npz"):
        with pytest.raises(PredictorError, match=WRONG):
            read(wrong)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda document: document["meta"].update(stance_ms=150), "digest does not match"),
        (lambda document: document["meta"].update(unknown=150), WRONG),
        (lambda document: document.update(format=1), "got format 1, expected format 3"),
        (lambda document: document["provenance"].update(gates={}), WRONG),
        (lambda document: document.pop("sha256"), WRONG),
        (lambda document: [document.clear(), document.update(a="[" * 100_000)], WRONG),
    ],
    ids=["content", "field", "format", "gates", "digest", "text"],
)
def test_a_document_that_was_changed(
    stored: Path, change: Callable[[dict[str, Any]], None], message: str
) -> None:
    with np.load(stored) as archive:
        G, document = archive["G"], json.loads(str(archive["document"]))
    change(document)
    np.savez(stored, G=G, document=np.array(document.get("a") or json.dumps(document)))
    with pytest.raises(PredictorError, match=message):
        read(stored)


def test_a_place_that_cannot_be_written(
    tmp_path: Path, fitted: tuple[Predictor, Provenance]
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(PredictorError, match="expected a file that can be written"):
        save(tmp_path / "file" / "predictor.npz", fitted[0])


@pytest.mark.parametrize(
    ("header", "body"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776, 8), }", b""),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", b""),
        ("(" * 3000, b""),
    ],
    ids=["8 TiB", "objects", "deep"],
)
def test_an_array_that_declares_what_it_is_not(stored: Path, header: str, body: bytes) -> None:
    text = header.encode() + b"\n"
    damaged = b"\x93NUMPY\x02\x00" + len(text).to_bytes(4, "little") + text + body
    with zipfile.ZipFile(stored) as archive:
        document = archive.read("document.npy")
    with zipfile.ZipFile(stored, "w") as archive:
        archive.writestr("document.npy", document)
        archive.writestr("G.npy", damaged)
    with pytest.raises(PredictorError, match=WRONG):
        read(stored)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 1 << 20), bit=st.integers(0, 7))
def test_no_flipped_bit_makes_the_reader_fall_over(stored: Path, at: int, bit: int) -> None:
    whole = stored.read_bytes()
    content = bytearray(whole)
    # Half of the tries among what tells what the arrays are, at the file's ends.
    at = at % len(content) if at % 2 else (at % 400) - 200
    content[at] ^= 1 << bit
    path = stored.with_name("flipped.npz")
    path.write_bytes(content)
    with suppress(PredictorError):
        read(path)
