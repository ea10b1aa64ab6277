"""What a recording holds, in words."""

from __future__ import annotations

from collections.abc import Iterator

from quadriga.recordings.metadata import read_counts, recorded_patterns, recorded_versions
from quadriga.recordings.survey import Survey, type_of
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import departures
from quadriga.shared.recording.metadata import END
from quadriga.shared.recording.quota import describe_refused
from quadriga.shared.recording.ticks import TickTrack
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.runtime.clock import format_local
from quadriga.tables import NOTHING, align_columns

_EVENTS = 40  # as many are shown


def format_survey(survey: Survey) -> list[str]:
    """Everything a user wants to know of a recording before looking into it, line by line."""
    heads = ("key", "type", "messages", "per s", "from tick", "to tick", "lost")
    blocks = {
        str(survey.path): align_columns(_about(survey)),
        "topics": align_columns([heads, *_topics(survey)], right=range(2, 7)),
        "configuration, where it differs from the defaults": align_columns(
            _differences(survey.config)
        ),
        "events": align_columns(_events(survey), right=(0,)),
        "agents at the end": align_columns(_agents(survey)),
    }
    return [line for title, lines in blocks.items() if lines for line in (title, *lines)]


def _about(s: Survey) -> Iterator[tuple[str, str]]:
    yield "file", f"{s.size / 1e6:.2f} MB, {'damaged' if s.error else 'whole'}"
    for damage in s.damages[:10]:
        yield "damage", damage
    if s.log_times is not None:
        first, last = s.log_times
        start = format_local("%Y-%m-%d %H:%M:%S %Z", first)
        yield "recorded", f"{start}, {(last - first) / 1e9:.2f} s wall time"
    lost = sum(track.lost for track in s.tracks.values())
    yield "messages", f"{sum(t.count for t in s.tracks.values()):,}, {lost:,} lost"
    for text in describe_refused(read_counts(s.notes)):
        yield "not stored", text
    begin = min((t.first for k, t in s.tracks.items() if k.endswith("/state")), default=-1)
    late = (
        f", joined at {begin / 1000:.3f} s"
        if begin > 0 and s.metadata.get("part", "0") == "0"
        else ""
    )
    yield "world time", f"{s.world_ms / 1000:.3f} s{late}"
    if "part" in s.metadata:
        yield "part", f"{s.metadata['part']} of a recording in several files, counted from 0"
    for name in ("topics", "exclude"):
        if name in s.metadata:
            yield f"--{name}", " ".join(recorded_patterns(s.metadata, name)) or NOTHING
    if s.config is not None:
        c = s.config
        known = c.team.robot in ROBOTS
        kind = c.robot.title if known else f"{c.team.robot} (a robot that is not installed here)"
        robots = f"{c.team.robots} × {kind}"
        yield (
            "team",
            f"{c.team.name}, {robots}, {c.world.mode}, "
            f"{c.world.scenario or c.world.terrain}, "
            f"seed {c.world.seed}",
        )
        yield "planner", c.planner.kind
        if c.team.agent_command:
            yield "controller", s.metadata.get("controller", c.team.agent_command)
    yield "falls", ", ".join(e.robot for e in s.events if e.kind == "fall") or "none"
    vanished = s.notes.get(END, {}).get("detail", NOTHING)
    yield "end", next((e.detail for e in reversed(s.events) if e.kind == "stop"), vanished)
    for robot, status in s.statuses.items():
        if status.reason:
            yield f"{robot} stopped", status.reason
    yield "predictor", s.metadata.get("predictor_sha256", "")[:16] or NOTHING
    yield "configuration", s.metadata.get("config_sha256", "")[:16] or NOTHING
    versions = recorded_versions(s.metadata)
    yield "versions", ", ".join(f"{name} {of}" for name, of in versions.items()) or NOTHING


def _topics(s: Survey) -> Iterator[tuple[str, ...]]:
    for key, track in s.tracks.items():
        yield (
            key,
            type_of(key),
            f"{track.count:,}",
            _rate(track),
            _tick(track.first),
            _tick(track.last if track.first >= 0 else -1),
            f"{track.lost:,}" if track.lost else "0",
        )


def _events(s: Survey) -> Iterator[tuple[str, ...]]:
    for event in s.events[:_EVENTS]:
        yield f"{event.tick / 1000:.3f} s", event.kind, event.robot or NOTHING, event.detail
    if len(s.events) > _EVENTS:
        more = f"{len(s.events) - _EVENTS} more: quadriga echo sim/event --file {s.path}"
        yield "…", more, "", ""


def _agents(s: Survey) -> Iterator[tuple[str, ...]]:
    for name, status in s.statuses.items():
        counted = ", ".join(f"{k} {v:,}" for k, v in sorted(status.counters.items()))
        yield name, status.mode, status.reason, counted


def _differences(config: Config | None) -> Iterator[tuple[str, str]]:
    """Keys that are not at their defaults."""
    for name, value, usual, _ in departures(config or Config(), Config()):
        shown, default = (str(v) if v != "" else NOTHING for v in (value, usual))
        yield name, f"{shown}  (default {default})"


def _rate(track: TickTrack) -> str:
    """Messages per second of world time."""
    span = track.last - track.first
    return f"{1000 * (track.count - 1) / span:.1f}" if track.first >= 0 and span > 0 else NOTHING


def _tick(tick: int) -> str:
    return str(tick) if tick >= 0 else NOTHING
