"""SHELL of published trials: campaigns beside what came of them, packed, to be gone on with."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.experiments.campaign.ledger import (
    ROWS,
    explain_write_errors,
    manifest_of,
    manifest_text,
    read_manifest,
    read_rows,
    rows_of,
    rows_text,
)
from quadriga.experiments.campaign.manifest import FILE, Manifest
from quadriga.experiments.published.experiment import Experiment, Part
from quadriga.experiments.published.summarise_experiment import CampaignTrials
from quadriga.experiments.trial.origin import is_same_code
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.atomic import write_bytes

TRIALS: Final = Path("docs/results/trials")
Campaigns = Mapping[Part, CampaignTrials]


def pack_trials(experiment: Experiment, campaigns: Campaigns, into: Path) -> None:
    """Pack an experiment's campaigns, instead of those packed before.

    Equal trials give equal files, whatever was typed and in which order they were walked.

    Args:
        experiment: whose.
        campaigns: of those of its parts that were begun.
        into: the checkout to keep them in.

    Raises:
        OSError: a file cannot be written.
    """
    written = set()
    for part, (manifest, rows) in campaigns.items():
        packed = experiment.folder(into / TRIALS, part)
        packed.mkdir(parents=True, exist_ok=True)
        alike = replace(manifest, typed=())  # commands name folders of one machine
        for name, text in ((ROWS, rows_text(rows, manifest)), (FILE, manifest_text(alike))):
            written.add(path := packed / f"{name}.gz")
            _pack(path, text.encode("utf-8"))
    for path in (into / TRIALS / experiment.name).rglob("*.gz"):
        if path not in written:
            path.unlink()


def read_published_trials(experiment: Experiment, into: Path) -> Campaigns:
    """An experiment's campaigns as they are kept; none that nobody has published.

    Raises:
        ConfigError: a file is not what was written there.
    """
    manifests = {part: read_published_manifest(experiment, part, into) for part in experiment.parts}
    return {
        part: (manifest, _rows(experiment, part, into, manifest))
        for part, manifest in manifests.items()
        if manifest is not None
    }


def has_more_published(experiment: Experiment, campaigns: Campaigns, into: Path) -> bool:
    """Whether more trials than these are published, of the same code and libraries.

    Raises:
        ConfigError: a file is not what was written there.
    """
    manifests = [read_published_manifest(experiment, part, into) for part in experiment.parts]
    old = {manifest.versions for manifest in manifests if manifest is not None}
    mine = {manifest.versions for manifest, _ in campaigns.values()}
    if not old or not all(is_same_code(one, other) for one in old for other in mine):
        return False
    return _count(read_published_trials(experiment, into)) > _count(campaigns)


def unpack_trials(experiment: Experiment, part: Part, into: Path, runs: Path) -> int:
    """Make the folder of one of an experiment's published campaigns, unless it is there.

    Returns:
        How many trials were unpacked.

    Raises:
        ConfigError: the folder lacks some of them, cannot be written, or nothing is published.
    """
    manifest = read_published_manifest(experiment, part, into)
    if manifest is None:
        raise ConfigError(f"--from-published: {experiment.name}", "nothing", "published trials")
    folder, rows = experiment.folder(runs, part), _rows(experiment, part, into, manifest)
    if (folder / FILE).exists():
        there = {(row.group, row.seed) for row in read_rows(folder, read_manifest(folder))}
        missing = sum((row.group, row.seed) not in there for row in rows)
        if missing:
            raise ConfigError(
                f"--from-published: {folder}",
                f"a folder without {missing:,} of the published trials",
                "one with all of them, or none",
                "--out names another",
            )
        return 0
    with explain_write_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        write_bytes(folder / ROWS, rows_text(rows, manifest).encode("utf-8"))
        write_bytes(folder / FILE, manifest_text(manifest).encode("utf-8"))
    return len(rows)


def read_published_manifest(experiment: Experiment, part: Part, into: Path) -> Manifest | None:
    """What one of an experiment's campaigns consists of as it is published, if it is.

    Raises:
        ConfigError: the file is not what was written there.
    """
    path = experiment.folder(into / TRIALS, part) / f"{FILE}.gz"
    return manifest_of(_unpack(path), str(path)) if path.is_file() else None


def _count(campaigns: Campaigns) -> int:
    return sum(len(rows) for _, rows in campaigns.values())


def _rows(experiment: Experiment, part: Part, into: Path, manifest: Manifest) -> list[TrialOutcome]:
    path = experiment.folder(into / TRIALS, part) / f"{ROWS}.gz"
    return rows_of(_unpack(path), str(path), manifest)


def _pack(path: Path, body: bytes) -> None:
    """Write it, unless what is there says the same: other versions of zlib pack otherwise."""
    try:
        same = gzip.decompress(path.read_bytes()) == body
    except (OSError, EOFError, zlib.error):
        same = False
    if not same:
        write_bytes(path, gzip.compress(body, mtime=0))


def _unpack(path: Path) -> bytes:
    try:
        return gzip.decompress(path.read_bytes())
    except (OSError, EOFError, zlib.error) as error:
        raise ConfigError(str(path), str(error), "published trials", "edited by hand?") from None
