"""One MCAP file for Foxglove: protobuf with named fields, and the team to look at."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import foxglove
import foxglove.messages as fox
from foxglove.channels import FrameTransformsChannel, LogChannel, SceneUpdateChannel

from quadriga.export.columns import TickReached
from quadriga.export.layout import MessageLayout
from quadriga.export.planned_forces import PlannedForces
from quadriga.export.protobuf import ProtobufType, build_type
from quadriga.export.scene import Scene, stamp_of
from quadriga.export.source import WARNINGS, ExportedMessage, Source
from quadriga.export.team_scene import PERIOD_MS, path_ticks
from quadriga.export.tracking import NAMES, Tracking
from quadriga.pictures.poses import Poses, read_poses, truth_ticks
from quadriga.recordings.traces import read_traces
from quadriga.shared.messages import Event, Measurement, Message, Truth
from quadriga.shared.topics import MEASUREMENT, PLAN, TRUTH


def write_foxglove(source: Source, out: Path, on_tick: TickReached) -> tuple[Path, ...]:
    """Write a recording for Foxglove.

    Times are the world's: a message of 12.3 s stands at 12.3 s since 1970.

    Args:
        source: what to write.
        out: the file; it must not exist.
        on_tick: called with each tick that was reached.

    Raises:
        OSError: the file cannot be written.
    """
    context = foxglove.Context()
    with _open(out, context):
        scalars, drawing = _Scalars(source, context), _Drawing(source, context)
        events = LogChannel("/events", context=context)
        for item in source.items():
            message, time = item.message, item.message.tick * 1_000_000
            scalars.log(item, time)
            if isinstance(message, Truth):
                drawing.log(message.tick, time)
                on_tick(message.tick)
            elif isinstance(message, Event):
                events.log(_build_log(message), log_time=time)
    return (out,)


@contextmanager
def _open(out: Path, context: foxglove.Context) -> Iterator[None]:
    """What is logged in `context` goes to a file; that its disk is full shows when it is closed."""
    foxglove.set_log_level(logging.CRITICAL)  # it would complain of every message
    writer = foxglove.open_mcap(out, context=context)
    try:
        yield
    finally:
        try:
            writer.close()
        except RuntimeError as error:
            raise OSError(str(error)) from None


class _Scalars:
    """One channel for each key, and `tracking` beside each robot's measurements."""

    def __init__(self, source: Source, context: foxglove.Context) -> None:
        self._context = context
        self._types: dict[type[Message], ProtobufType] = {}
        self._channels: dict[str, foxglove.Channel] = {}
        self._tracking = Tracking(source.recording) if MEASUREMENT.name in source.topics else None
        self._tracked = ProtobufType("Tracking", [("tick", int)], [], NAMES)

    def log(self, item: ExportedMessage, time: int) -> None:
        message, layout = item.message, item.layout
        kind = self._types.get(layout.kind)
        if kind is None:
            kind = self._types[layout.kind] = build_type(layout)
        cut = layout.sampled
        samples = item.numbers[:, :cut] if cut else None
        payload = kind.encode(_read_plain(message, layout), item.numbers[0, cut:], samples)
        self._channel(f"/{item.name}", kind).log(payload, log_time=time)
        if self._tracking is not None and isinstance(message, Measurement):
            row = self._tracking.row(item.robot, message.tick)
            if row is not None:
                payload = self._tracked.encode({"tick": message.tick}, row)
                self._channel(f"/{item.robot}/tracking", self._tracked).log(payload, log_time=time)

    def _channel(self, topic: str, kind: ProtobufType) -> foxglove.Channel:
        channel = self._channels.get(topic)
        if channel is None:
            schema = foxglove.Schema(name=kind.name, encoding="protobuf", data=kind.descriptor)
            channel = self._channels[topic] = foxglove.Channel(
                topic, schema=schema, message_encoding="protobuf", context=self._context
            )
        return channel


class _Drawing:
    """Frames, bodies, terrain, yokes and forces, where the truth was recorded."""

    def __init__(self, source: Source, context: foxglove.Context) -> None:
        self._frames = FrameTransformsChannel("/frames", context=context)
        self._bodies = SceneUpdateChannel("/scene/robots", context=context)
        self._terrain = SceneUpdateChannel("/scene/terrain", context=context)
        self._forces = SceneUpdateChannel("/scene/forces", context=context)
        self._row: dict[int, int] = {}
        self._drawn = False
        if TRUTH.name in source.topics:
            ticks = path_ticks(truth_ticks(source.recording), PERIOD_MS)
            self._poses: Poses = read_poses(source.recording, ticks)
            self._scene = Scene(source.config)
            self._planned = PlannedForces(read_traces(source.recording, {PLAN.name, TRUTH.name}))
            self._row = {tick: i for i, tick in enumerate(ticks.tolist())}

    def log(self, tick: int, time: int) -> None:
        at = self._row.pop(tick, None)
        if at is None:
            return
        if not self._drawn:
            self._drawn = True
            self._bodies.log(self._scene.bodies(tick), log_time=time)
            self._terrain.log(self._scene.terrain(tick, self._poses.centre()), log_time=time)
        self._scene.set(self._poses.qpos[at])
        self._frames.log(self._scene.frames(tick), log_time=time)
        forces = self._scene.forces(tick, self._poses.grf[at], self._planned.at(tick))
        self._forces.log(forces, log_time=time)


def _read_plain(message: Message, layout: MessageLayout) -> dict[str, object]:
    plain: dict[str, object] = {"tick": message.tick}
    plain |= {name: getattr(message, name) for name, _ in layout.plain}
    plain |= {name: getattr(message, name).tolist() for name in layout.lists}
    return plain


def _build_log(event: Event) -> fox.Log:
    level = fox.LogLevel.Warning if event.kind in WARNINGS else fox.LogLevel.Info
    return fox.Log(
        timestamp=stamp_of(event.tick),
        level=level,
        name=event.robot or "world",
        message=f"{event.kind}: {event.detail}",
    )
