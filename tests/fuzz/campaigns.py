"""What campaigns and other series of walks leave for later ones to read, and publish."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.experiments.campaign.ledger import (
    ROWS,
    manifest_text,
    read_manifest,
    read_rows,
    rows_text,
)
from quadriga.experiments.campaign.manifest import FILE
from quadriga.experiments.published.experiment import Part
from quadriga.experiments.published.experiment_file import read_experiment
from quadriga.experiments.published.published_trials import TRIALS, read_published_trials
from quadriga.shared.errors import QuadrigaError
from quadriga.team.trial_rows import ROWS as JSON_ROWS
from quadriga.team.trial_rows import read_rows as read_json_rows
from tests.fuzz.damage import damage
from tests.fuzz.target import Reader, change_json, choose, file_reader
from tests.quadriga.experiments.rows import manifest, row

_DEPLOY: Final = Path(__file__).parents[2] / "deploy"
_CELLS: Final = (
    "9" * 5000,
    "1e999",
    "nan",
    "-1",
    "",
    "true",
    '"',
    "\0",
    "\x1b[2J",
    "x" * 200_000,
    "0x1",
)


def manifests(folder: Path) -> Reader:
    """What a campaign consists of."""
    campaign = manifest("none", "distributed", sweeps=("world.friction",), swept=(("0.5",),))

    def read(path: Path) -> None:
        found = read_manifest(path.parent)
        found.merge(found, path.parent)
        assert found.trials >= 0
        manifest_text(found)

    good = manifest_text(campaign).encode()
    return file_reader(folder / FILE, [good], read, change_json)


def trials(folder: Path) -> Reader:
    """Rows of the trials of a campaign."""
    campaign = manifest("none", "distributed")
    rows = [row("none", 0), row("distributed", 1, fell=2.5), row("none", 2)]
    path = folder / ROWS

    def read(path: Path) -> None:
        for found in read_rows(path.parent, campaign):
            found.count_plans()

    return file_reader(path, [rows_text(rows, campaign).encode()], read, _change_cells)


class Packs:
    """Published trials of an experiment, and what they consist of, which are packed."""

    def __init__(self, folder: Path) -> None:
        campaign = manifest("none", "distributed")
        written = _DEPLOY / "experiments" / "as-written.toml"
        self._experiment = replace(read_experiment(written), parts=(Part("", ("flat",)),))
        self._into = folder
        packed = self._experiment.folder(folder / TRIALS, self._experiment.parts[0])
        packed.mkdir(parents=True)
        self._paths = [packed / f"{name}.gz" for name in (FILE, ROWS)]
        texts = (manifest_text(campaign), rows_text([row("none", 0)], campaign))
        self._good = [gzip.compress(text.encode(), mtime=0) for text in texts]

    def make(self, random: np.random.Generator) -> bytes:
        good, chance = choose(self._good, random), random.random()
        if chance < 0.02:
            return gzip.compress(bytes(1 << 24), 1, mtime=0)  # small, and of much more if unpacked
        if chance < 0.5:
            return damage(good, random)
        return gzip.compress(change_json(gzip.decompress(good), random), 1, mtime=0)

    def read(self, content: bytes) -> None:
        for path in self._paths:
            for other, good in zip(self._paths, self._good, strict=True):
                other.write_bytes(content if other == path else good)
            try:
                read_published_trials(self._experiment, self._into)
            except QuadrigaError:
                if path is self._paths[-1]:
                    raise


def json_rows(folder: Path) -> Reader:
    """Trials of one configuration, a line of JSON each."""
    line = json.dumps({"fault": "imu", "seed": 3, "ms": 4.5, "went": ["r1", None]}) + "\n"

    def read(path: Path) -> None:
        read_json_rows(path.parent)

    return file_reader(folder / JSON_ROWS, [2 * line.encode()], read, change_json)


def _change_cells(good: bytes, random: np.random.Generator) -> bytes:
    """A table with another cell, or damaged anyhow."""
    if random.random() < 0.5:
        return damage(good, random)
    lines = good.decode().splitlines()
    at = int(random.integers(len(lines)))
    cells = lines[at].split(",")
    cells[int(random.integers(len(cells)))] = _CELLS[int(random.integers(len(_CELLS)))]
    lines[at] = ",".join(cells)
    return ("\n".join(lines) + "\n").encode()
