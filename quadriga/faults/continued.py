"""A walk whose recorder was started again: several files, read as one."""

from __future__ import annotations

from collections.abc import Container, Iterator
from pathlib import Path

from quadriga.shared.recording.reader import ChunkEntry, Recording


class ContinuedRecording(Recording):
    """A recording, and those that other recorders of the same walk made after it.

    Metadata and where it was cut are the first one's, what was noted at the end the last one's.
    """

    def __init__(self, path: Path) -> None:
        """Open a recording `run.mcap`, and `run.2.mcap` and so on beside it.

        Raises:
            RecordingError: one of them is no recording.
        """
        super().__init__(path)
        later = path.parent.glob(f"{path.stem}.*{path.suffix}")
        self._later = [Recording(file) for file in sorted(later)]

    def entries(
        self, names: Container[str] | None = None, keys: Container[str] | None = None
    ) -> Iterator[ChunkEntry]:
        yield from super().entries(names, keys)
        for recording in self._later:
            yield from recording.entries(names, keys)

    @property
    def notes(self) -> dict[str, dict[str, str]]:
        return self._later[-1].notes if self._later else super().notes
