"""SHELL of published trials: campaigns beside what came of them, packed, to be gone on with."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.campaign.job import origin
from quadriga.campaign.ledger import (
    ROWS,
    kept_in,
    manifest_of,
    manifest_text,
    read_manifest,
    rows_of,
    write_bytes,
)
from quadriga.campaign.manifest import FILE
from quadriga.experiments.experiment import Experiment
from quadriga.experiments.summarise import Walked
from shared.errors import ConfigError

TRIALS: Final = Path("docs/results/trials")
_FILES: Final = (ROWS, FILE)  # in this order: what makes a folder a campaign's comes last


def keep(experiment: Experiment, runs: Path, into: Path) -> None:
    """Pack an experiment's campaigns; equal trials give equal bytes, whatever was typed.

    Args:
        experiment: whose.
        runs: where their folders are, of those that were begun.
        into: the checkout to keep them in.

    Raises:
        ConfigError: a folder is not what was written there.
        OSError: a file cannot be read or written.
    """
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        packed = experiment.folder(into / TRIALS, part)
        if (folder / FILE).is_file():
            manifest = replace(read_manifest(folder), typed=())  # it names folders of one machine
            packed.mkdir(parents=True, exist_ok=True)
            _pack(packed / f"{ROWS}.gz", (folder / ROWS).read_bytes())
            _pack(packed / f"{FILE}.gz", manifest_text(manifest).encode("utf-8"))


def kept(experiment: Experiment, into: Path) -> list[Walked]:
    """An experiment's campaigns as they are kept; none that nobody has published.

    Raises:
        ConfigError: a file is not what was written there.
    """
    found: list[Walked] = []
    for part in experiment.parts:
        packed = experiment.folder(into / TRIALS, part)
        if (packed / f"{FILE}.gz").is_file():
            texts = _texts(packed)
            manifest = manifest_of(texts[FILE], str(packed / f"{FILE}.gz"))
            found.append((manifest, rows_of(texts[ROWS], str(packed / f"{ROWS}.gz"), manifest)))
    return found


def take_up(experiment: Experiment, into: Path, runs: Path) -> None:
    """Unpack an experiment's published campaigns, to go on with; one that is there stays.

    Raises:
        ConfigError: they were walked with other code or libraries, a file is not what was written
            there, or the folder cannot be written to.
    """
    for manifest, _ in kept(experiment, into):
        if manifest.versions != origin():
            raise ConfigError(f"--from-published: {experiment.name}", f"trials with {origin()}",
                              manifest.versions, "without the option all is walked anew"
                              )  # fmt: skip
    for part in experiment.parts:
        folder = experiment.folder(runs, part)
        packed = experiment.folder(into / TRIALS, part)
        if (packed / f"{FILE}.gz").is_file() and not (folder / FILE).exists():
            with kept_in(folder):
                folder.mkdir(parents=True, exist_ok=True)
                for name, text in _texts(packed).items():
                    write_bytes(folder / name, text)


def _pack(path: Path, body: bytes) -> None:
    write_bytes(path, gzip.compress(body, mtime=0))


def _texts(packed: Path) -> dict[str, bytes]:
    try:
        return {name: gzip.decompress((packed / f"{name}.gz").read_bytes()) for name in _FILES}
    except (OSError, EOFError) as error:
        raise ConfigError(str(packed), str(error), "published trials", "edited by hand?") from None
