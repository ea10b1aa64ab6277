"""The gallery of the manual: a clip of each scenario, from real walks, and the page that has them.

Run: python -m quadriga.experiments.gallery [NAME …], or with --page for the page alone, on stdout.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from PIL import Image, ImageSequence
from rich.console import Console

from quadriga.identification.predictors import fit_or_read
from quadriga.identification.rollout import Rollout
from quadriga.pictures.frames import CLIP
from quadriga.pictures.render import render
from quadriga.recordings.metadata import build_metadata
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.metadata import RECORDING
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.shared.runtime.atomic import atomic_write, write_text
from quadriga.shared.runtime.places import SOURCE
from quadriga.shared.topics import SAMPLE_MS, STATE, TRUTH
from quadriga.team.operator import references_of
from quadriga.team.scenarios import LABEL, description, names, path

FOLDER: Final = SOURCE / "docs" / "gallery"
PAGE: Final = SOURCE / "docs" / "gallery.md"
_SEED: Final = 7
_SECONDS: Final = 8
_AFTER_FALL: Final = 1000  # ms, until a walk is over in which a robot falls
# Teams whose data would be collected for a clip of some seconds alone.
_UNPLANNED: Final = (
    *("asymmetric-5", "chain-5", "payload-heavy-2", "payload-heavy-4"),
    *("payload-uneven-5", "ring-5", "ten"),
)
_SIZE: Final = (384, 216)  # pixels
_EVERY: Final = 2  # frames of the walk's own clip for one of these
_FRAMES: Final = 28
_QUALITY: Final = 45
_BEYOND: Final = "beyond the paper"
_GROUPS: Final = (
    ("On hard ground", "hard-"),
    ("At the edge: about half of the teams fall", "edge-"),
    ("One robot alone is disturbed", "distribution-"),
)
_HEAD: Final = """\
# Gallery of scenarios

A scenario is a configuration file of `deploy/scenarios`; every seed gives another world of it.
Below each clip is the command that walked it. Arrows are the forces of the ground. This page and
its clips are made by `make gallery`.
"""


def main(words: Sequence[str] | None = None) -> int:
    """Walk and draw what is asked for, then write the page; or print the page."""
    parser = argparse.ArgumentParser(prog="python -m quadriga.experiments.gallery")
    parser.add_argument("names", nargs="*", metavar="NAME", help="of scenarios (all)")
    parser.add_argument("--page", action="store_true", help="print the page, and walk nothing")
    given = parser.parse_args(words)
    if given.page:
        print(build_page(FOLDER), end="")
        return 0
    FOLDER.mkdir(exist_ok=True)
    for name in given.names or names():
        clip = FOLDER / f"{name}.webp"
        with tempfile.TemporaryDirectory() as folder:
            shrink_clip(walk_scenario(name, Path(folder) / "run"), clip)
        print(f"{clip}: {clip.stat().st_size / 1000:.0f} kB", flush=True)
    write_text(PAGE, build_page(FOLDER))
    return 0


def command_of(scenario: str) -> tuple[str, ...]:
    """The walk of a scenario's clip, without the program's name."""
    unplanned = ("--planner", "none") if scenario in _UNPLANNED else ()
    options = ("--seed", str(_SEED), "--seconds", str(_SECONDS), *unplanned)
    return ("walk", "--scenario", scenario, *options)


def configure(scenario: str) -> Config:
    """The configuration of that walk."""
    keys = {LABEL: scenario, "world.seed": _SEED, "world.duration": float(_SECONDS)}
    unplanned = {"planner.kind": "none"} if scenario in _UNPLANNED else {}
    return load(path(scenario), keys | unplanned)


def walk_scenario(scenario: str, folder: Path) -> Path:
    """Walk a scenario, in this process with the bytes of a walk over the bus; its clip.

    Args:
        scenario: its name.
        folder: a new one, for what pictures are made of.
    """
    config = configure(scenario)
    predictor = None
    if find_kind(config.planner.kind).needs_predictor:
        predictor, _ = fit_or_read(config, Console(stderr=True))
    rollout, last = Rollout(config, predictor, references_of(config)), 1000 * _SECONDS
    with RecordingWriter(folder / RECORDING, build_metadata(config, "")) as writer:
        while (tick := rollout.world.tick) < last:
            if tick % SAMPLE_MS == 0:
                _record(rollout, config.team.name, writer)
            rollout.step()
            if rollout.world.fallen():
                last = min(last, tick + _AFTER_FALL)
    render(folder)
    return folder / CLIP


def _record(rollout: Rollout, team: str, writer: RecordingWriter) -> None:
    """Write down where the robots are at this tick."""
    world = rollout.world
    now_ns = 1_000_000 * world.tick
    writer.write(TRUTH.key(team), encode(world.truth()), now_ns)
    for name, state in world.states().items():
        writer.write(STATE.key(team, name), encode(state), now_ns)


def shrink_clip(source: Path, target: Path) -> None:
    """Write the last moments of a clip again: smaller, and with fewer frames.

    Args:
        source: an animated picture.
        target: a WebP file to write.
    """
    with Image.open(source) as clip:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(clip)]
        each_ms = int(clip.info.get("duration", 80))
    newest_first = frames[::-_EVERY][:_FRAMES]
    first, *others = (frame.resize(_SIZE) for frame in reversed(newest_first))
    with atomic_write(target) as partial:
        first.save(
            partial,
            format="WEBP",
            save_all=True,
            append_images=others,
            duration=_EVERY * each_ms,
            loop=0,
            quality=_QUALITY,
            method=6,
        )


def build_page(folder: Path) -> str:
    """The page: all scenarios in groups, the paper's first.

    Args:
        folder: the clips, of which some may be missing.
    """
    return "".join((_HEAD, *_describe_groups(folder)))


def _describe_groups(folder: Path) -> Iterator[str]:
    left = {name: description(name) for name in names()}
    papers = [name for name, text in left.items() if _BEYOND not in text]
    groups = [("The paper's five", papers)]
    groups += [(title, [n for n in left if n.startswith(start)]) for title, start in _GROUPS]
    grouped = {name for _, members in groups for name in members}
    groups.append(("Others", [name for name in left if name not in grouped]))
    for title, members in groups:
        yield f"\n## {title}\n"
        for name in members:
            yield f"\n### {name}\n\n{left[name]}\n"
            if (folder / f"{name}.webp").is_file():
                yield f"\n![{name}]({folder.name}/{name}.webp)\n"
            yield f"\n```sh\nquadriga {' '.join(command_of(name))}\n```\n"


if __name__ == "__main__":
    sys.exit(main())
