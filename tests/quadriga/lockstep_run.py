"""A lock-step recording of a world whose robots are told to wriggle, written without a bus."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from quadriga.recordings.metadata import build_metadata
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.sim_server.world.world import World
from tests.a1 import q_stand

Packet = tuple[str, bytes]
Change = Callable[[int, str, bytes], bytes | None]
TICKS = 300
SCENE = {
    "team.robots": 2, "world.terrain": "boxes", "world.terrain_height": 0.03, "world.seed": 5,
    "world.payload": 3.0, "world.push": "r1:60:90:0.1:0.05", "world.duration": 0.5,
}  # fmt: skip


def command(tick: int, robot: int) -> Command:
    rng = np.random.default_rng((tick, robot))
    q_des = q_stand() + 0.1 * rng.standard_normal(12)
    return Command(
        tick,
        10**6 * tick,
        rng.standard_normal(12),
        q_des,
        np.zeros(12),
        np.full(12, 60.0),
        np.full(12, 2.0),
    )


def config(**keys: object) -> Config:
    return load(None, SCENE | {name.replace("__", "."): value for name, value in keys.items()})


def packets(config: Config) -> Iterator[tuple[int, str, bytes]]:
    """What is published in each tick."""
    world = World(config)
    for tick in range(TICKS):
        if tick % 10 == 0:
            yield tick, "team/sim/truth", encode(world.truth())
        for name, state in world.states().items():
            yield tick, f"team/{name}/state", encode(state)
        commands = {name: command(tick, i) for i, name in enumerate(world.names)}
        for name, sent in commands.items():
            yield tick, f"team/{name}/command", encode(sent)
        if tick % 50 == 20:  # refused by the world: of the future, of the past, and a foreign one's
            for forged in (tick + 20, tick - 20):
                yield tick, "team/r1/command", encode(replace(command(forged, 0), kp=np.ones(12)))
            for key in ("team/r7/state", "team/r2/state"):
                yield tick, key, encode(world.states()["r1"])
        for event in world.step(commands):
            yield tick, "team/sim/event", encode(event)


def write_lockstep(
    path: Path, config: Config, change: Change = lambda _tick, _key, payload: payload
) -> Path:
    """Write a recording in which messages stand up to some 30 apart from their place.

    `change` may replace a payload, or lose it.
    """
    shuffle = random.Random(3)
    sent = [(i + shuffle.uniform(0, 30), packet) for i, packet in enumerate(packets(config))]
    last: dict[str, float] = {}
    ordered = []
    for place, packet in sent:  # the order of one key is always kept
        last[packet[1]] = max(place, last.get(packet[1], 0.0))
        ordered.append((last[packet[1]], packet))
    with RecordingWriter(path, build_metadata(config, ""), 16) as writer:
        for at, (tick, key, payload) in sorted(ordered, key=lambda item: item[0]):
            changed = change(tick, key, payload)
            if changed is not None:
                writer.write(key, changed, 10**18 + round(1e5 * at))
    return path
