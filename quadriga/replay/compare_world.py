"""SHELL of `quadriga replay --world`: a bar while the world is recomputed, then the verdict."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.progress import build_progress
from quadriga.recordings.metadata import differing_versions
from quadriga.replay.world_replay import WorldComparison, replay_world
from quadriga.shared.printable import printable
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.runtime.clock import monotonic

_SHOWN: Final = 100  # ticks between looks at the bar


def compare_world(path: Path, console: Console) -> bool:
    """Recompute a recorded world; whether all of it came out equal.

    Raises:
        RecordingError: no recording, not of a lock-step world, or with commands missing.
    """
    recording = Recording(path)
    seconds = recorded_config(recording).world.duration
    begun = monotonic()
    last = WorldComparison(0, 0)
    bar = build_progress(console, "{task.completed:.1f}/{task.total:g} s", fleeting=True)
    with bar:
        task = bar.add_task("re-simulating", total=seconds)
        for last in replay_world(recording):
            if last.tick % _SHOWN == 0:
                bar.update(task, completed=last.tick / 1000)
    spent = monotonic() - begun
    _print_verdict(last, recording, spent, console)
    return last.difference is None


def _print_verdict(
    last: WorldComparison, recording: Recording, spent: float, console: Console
) -> None:
    world = last.tick / 1000
    pace = f"{world:.2f} s of world time in {spent:.1f} s, {world / spent:.1f} × real time"
    if last.difference is None:
        lines = [f"equal to the byte: {last.compared} states and truths, {pace}"]
        lines += [f"compared up to there only: {last.note}"] if last.note else []
    else:
        lines = [
            f"first difference: {last.difference}",
            f"{last.compared} messages before it are equal; {pace}",
        ]
        others = differing_versions(recording.metadata)
        if others:
            lines.append(f"recorded with other versions, which may be why: {others}")
    for line in lines:
        console.print(printable(line), markup=False, highlight=False, soft_wrap=True)
