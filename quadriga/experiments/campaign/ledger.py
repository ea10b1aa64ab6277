"""The folder of a campaign: what it consists of, and a row for each trial that is finished."""

from __future__ import annotations

import csv
import fcntl
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, Self

from quadriga.experiments.campaign.manifest import FILE, Manifest
from quadriga.experiments.trial.outcome import TrialOutcome, column_names, from_cells, to_cells
from quadriga.shared.errors import ConfigError, name_file_errors, system_reason
from quadriga.shared.runtime.atomic import write_text

ROWS: Final = "trials.csv"
_WRITTEN: Final = "what a campaign wrote there"


class Ledger:
    """A campaign's folder, open for one process alone; a context that must be entered.

    A row is on the disk before the next one is written, so that a kill costs no finished trial:
    what it may leave is part of a last line, which is cut off when the folder is opened again.

    Args:
        folder: new, or of a campaign that this one goes on with.
        manifest: what is to be walked; merged with what the folder's own says.

    Raises:
        ConfigError: the folder cannot be made, is in use, or holds another campaign's trials.
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        with name_file_errors(ConfigError, f"--out {folder}", "a folder that can be made"):
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = (folder / ".lock").open("wb")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise ConfigError(
                f"--out {folder}", "a folder in use", "one of no running campaign"
            ) from None
        try:
            before = read_manifest(folder) if (folder / FILE).is_file() else None
            self.manifest = manifest if before is None else before.merge(manifest, folder)
            self.rows = read_rows(folder, self.manifest)
            write_text(folder / FILE, manifest_text(self.manifest))
            _mend(folder / ROWS, self.manifest)
            self._file = (folder / ROWS).open("a", encoding="utf-8", newline="")
        except BaseException:
            self._lock.close()
            raise

    def append(self, row: TrialOutcome) -> None:
        """Keep a row; it is on the disk when this returns."""
        self._file.write(_line(to_cells(row)))
        self._file.flush()
        os.fsync(self._file.fileno())
        self.rows.append(row)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._lock.close()


def read_manifest(folder: Path) -> Manifest:
    """What a campaign's folder consists of.

    Raises:
        ConfigError: it is no campaign's folder, or another version's.
    """
    path = folder / FILE
    with name_file_errors(ConfigError, path, _WRITTEN):
        return manifest_of(path.read_bytes(), str(path))


def manifest_of(text: bytes, name: str) -> Manifest:
    """What a campaign's file says that it consists of.

    Raises:
        ConfigError: the text, of the file `name`, is something else, or another version's.
    """
    try:
        body: Mapping[str, Any] = json.loads(text)
        return Manifest.from_dict(body)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise ConfigError(name, str(error) or type(error).__name__, _WRITTEN) from None


def manifest_text(manifest: Manifest) -> str:
    """The inverse of `manifest_of`."""
    return json.dumps(asdict(manifest), indent=1) + "\n"


def read_rows(folder: Path, manifest: Manifest) -> list[TrialOutcome]:
    """The rows that are finished, each once; a torn last line is none.

    Raises:
        ConfigError: a line is no row, or a trial stands there twice.
    """
    path = folder / ROWS
    with name_file_errors(ConfigError, path, "a readable file"):
        text = path.read_bytes() if path.exists() else b""
    return rows_of(text, str(path), manifest)


def rows_of(text: bytes, name: str, manifest: Manifest) -> list[TrialOutcome]:
    """The rows that the text of the file `name` holds, as `read_rows` gives them.

    Raises:
        ConfigError: a line is no row, or a trial stands there twice.
    """
    whole = text[: text.rfind(b"\n") + 1].decode("utf-8", errors="replace")
    rows_by_trial: dict[tuple[object, int], TrialOutcome] = {}
    lines = csv.reader(io.StringIO(whole))
    try:
        for cells in lines:
            if lines.line_num == 1:
                if cells != column_names([sweep.key for sweep in manifest.sweeps]):
                    raise ValueError("other columns")
                continue
            row = from_cells(cells)
            if (row.group, row.seed) in rows_by_trial:
                raise ValueError(f"a second row of {row.group.name}, seed {row.seed}")
            if row.versions != manifest.versions:
                raise ValueError(f"a trial with code and versions {row.versions}")
            rows_by_trial[row.group, row.seed] = row
    except (ValueError, csv.Error) as error:
        raise ConfigError(
            f"{name}, line {lines.line_num}",
            str(error),
            "a row of this campaign",
            "edited by hand?",
        ) from None
    return list(rows_by_trial.values())


def rows_text(rows: Sequence[TrialOutcome], manifest: Manifest) -> str:
    """The inverse of `rows_of`, sorted: equal rows give equal text."""
    ordered = sorted(rows, key=lambda row: (row.group, row.seed))
    return _head(manifest) + "".join(_line(to_cells(row)) for row in ordered)


@contextmanager
def explain_write_errors(folder: Path) -> Iterator[None]:
    """What cannot be written into a folder is one error; what was written is kept.

    Raises:
        ConfigError: no place, or no permission.
    """
    try:
        yield
    except OSError as error:
        raise ConfigError(
            str(error.filename or folder), system_reason(error), "a place that can be written to"
        ) from None


def _mend(path: Path, manifest: Manifest) -> None:
    """Have the file end with a whole line, at least its head."""
    if path.exists():
        text = path.read_bytes()
        os.truncate(path, text.rfind(b"\n") + 1)
    if not path.exists() or not path.stat().st_size:
        write_text(path, _head(manifest))


def _head(manifest: Manifest) -> str:
    return _line(column_names([sweep.key for sweep in manifest.sweeps]))


def _line(cells: Sequence[str]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()
