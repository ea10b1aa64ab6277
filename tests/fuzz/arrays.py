"""Files of arrays: predictors, collected data, responses, quadratic programs."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.episode import Episode, check_episodes, team_layout
from quadriga.agents.predictor.gates import GateReport, Provenance, read
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import predictor_sha256, save
from quadriga.identification.dataset import Dataset, read_data, write_data
from quadriga.replay import saved_qp
from quadriga.replay.saved_qp import SavedQp
from quadriga.shared.config.load import load
from tests.fuzz.damage import damage
from tests.fuzz.target import change_json

REPORT: Final = GateReport(0.5, ((1.0, 1.0),), 0.1)
SMALL: Final = {"team.robots": 1, "planner.kind": "none", "planner.N": 8, "planner.T_ini": 4}
_EDGE: Final = 1000  # bytes at the begin and at the end, which tell of the arrays between
_SHAPES: Final = ((), (0,), (1,), (3, 0), (2, 2, 2, 2, 2), (1, 1, 4, 12), (1 << 20,))
_TYPES: Final = ("<f8", ">f4", "<i8", "|u1", "<c16", "<U3", "|b1", "<M8[s]")


class Archives:
    """Files of arrays as they are damaged, and as somebody might pack them.

    Args:
        path: of the file that is read.
        write: writes a good one.
        read: reads it; raises an error of the tree, or nothing.
        sign: gives changed arrays the digest that they should have; raises anything if it cannot.
    """

    def __init__(
        self,
        path: Path,
        write: Callable[[Path], object],
        read: Callable[[Path], object],
        sign: Callable[[dict[str, Any]], None] = lambda arrays: None,
    ) -> None:
        self._path, self._read, self._sign = path, read, sign
        write(path)
        self._good = path.read_bytes()
        with np.load(path) as archive:
            self._arrays = {name: archive[name] for name in archive.files}

    def make(self, random: np.random.Generator) -> bytes:
        chance = random.random()
        if chance < 0.5:
            if len(self._good) < 2 * _EDGE:
                return damage(self._good, random)
            edge = int(random.integers(1, 3)) * _EDGE
            edges = damage(self._good[:edge] + self._good[-edge:], random)
            return edges[:edge] + self._good[edge:-edge] + edges[edge:]
        arrays = dict(self._arrays)
        name = str(random.choice(list(arrays)))
        array = arrays[name]
        if array.dtype.kind == "U" and chance < 0.9:
            text = change_json(str(array).encode(), random).decode("utf-8", "replace")
            arrays[name] = np.array(text.replace("\0", " "))
        elif chance < 0.6:
            del arrays[name]
        elif chance < 0.7:
            return self._forge_head(name, random)
        elif chance < 0.8 and array.dtype.kind == "f":
            arrays[name] = np.where(random.random(array.shape) < 0.1, np.nan, array * 1e200)
        else:
            shape = _SHAPES[int(random.integers(len(_SHAPES)))]
            kind = _TYPES[int(random.integers(len(_TYPES)))]
            arrays[name] = np.zeros(shape, dtype=kind)
        with suppress(Exception):
            self._sign(arrays)
        packed = BytesIO()
        (np.savez if random.random() < 0.5 else np.savez_compressed)(packed, **arrays)
        return packed.getvalue()

    def _forge_head(self, name: str, random: np.random.Generator) -> bytes:
        """An archive with right checksums, one of whose arrays says of itself what is not so."""
        packed = BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for each, array in self._arrays.items():
                content = BytesIO()
                np.save(content, array)
                body = content.getvalue()
                if each == name:
                    body = damage(body[:128], random) + body[128:]
                    body = body.replace(b"'shape': (", b"'shape': (99999999999,", chance(random))
                archive.writestr(f"{each}.npy", body)
        return packed.getvalue()

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        self._read(self._path)


def chance(random: np.random.Generator) -> int:
    """One or nothing."""
    return int(random.integers(2))


def predictors(folder: Path) -> Archives:
    """Predictors of robots."""
    meta = PredictorMeta.of(load(None, SMALL))
    predictor = Predictor(meta, np.zeros((1, 1, 1, 6 * meta.N, meta.layout.width)))

    def write(path: Path) -> None:
        save(path, predictor, asdict(Provenance("abc", (1,), (900,), (100,), {}, REPORT)))

    def sign(arrays: dict[str, Any]) -> None:
        document = json.loads(str(arrays["document"]))
        changed = Predictor(PredictorMeta.from_dict(document["meta"]), arrays["G"])
        document["sha256"] = predictor_sha256(changed)
        arrays["document"] = np.array(json.dumps(document))

    return Archives(folder / "predictor.npz", write, read, sign)


def datasets(folder: Path) -> Archives:
    """Collected data."""
    random = np.random.default_rng(0)
    u, y = random.normal(size=(60, 1, 12)), random.normal(size=(60, 1, 6))
    episode = Episode(u, 0.0 * u, y, 0.0 * y, 10)
    whole = Dataset((episode, episode), (episode,), (1, 2))

    def read_all(path: Path) -> None:
        check_episodes(read_data(path).training, team_layout(1, 4, 8))

    return Archives(folder / "data.npz", lambda path: write_data(path, whole), read_all)


def saved_programs(folder: Path) -> Archives:
    """Quadratic programs of single steps."""
    one: Any = np.eye(3)
    saved = SavedQp(one, one[0], one, -np.ones(6), np.ones(6), one[0], "plan of r1")
    return Archives(
        folder / "qp.npz",
        lambda path: saved_qp.save(path, saved),
        lambda path: saved_qp.load(path).solve(),
    )
