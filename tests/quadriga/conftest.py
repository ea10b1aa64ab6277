"""A run written through the real writer from closed-form motions, so that its figures are known."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from quadriga.agents.gait import scheduled_stance
from quadriga.recordings.metadata import build_metadata
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config, ReferenceConfig, TeamConfig, WorldConfig
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.shared.robots.conventions import robot_names
from quadriga.sim_server.world.team_model import formation
from tests.a1 import nominal_forces, q_stand

SECONDS = 6.0
SPEED = 0.51  # m/s along the yaw axis, 0.01 more than asked for
ESTIMATOR_ERROR = np.array([0.001, 0.02, -0.03, 0.004, -0.005, 0.06])
WALL = 2.0  # wall time per world time
WALL_0 = 1_700_000_000_000_000_000

Packet = tuple[str, msg.Message]


def outputs(tick: int, index: int) -> np.ndarray:
    """True z, vx, vy, roll, pitch, wz of robot `index`: sines of whole periods per second."""
    phase = 2 * np.pi * tick / 1000
    return np.array(
        [0.26 + 0.004 * np.sin(5 * phase), SPEED, -0.02, 0.03 * np.cos(phase), 0.01 * index, 0.0]
    )


def truth(config: Config, tick: int, yaw: float) -> msg.Truth:
    n = config.team.robots
    y = np.array([outputs(tick, i) for i in range(n)])
    heading, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    pos, vel = np.zeros((n, 3)), np.zeros((n, 3))
    places = formation(n, config.team.spacing) @ np.array([heading, left])
    pos[:, :2] = places + heading * SPEED * tick / 1000
    pos[:, 2] = y[:, 0]
    vel[:, :2] = y[:, 1:2] * heading + y[:, 2:3] * left
    half = np.stack([np.full(n, yaw), y[:, 4], y[:, 3]]) / 2  # yaw, pitch, roll
    (cy, cp, cr), (sy, sp, sr) = np.cos(half), np.sin(half)
    quat = np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=1,
    )
    stance = np.stack([scheduled_stance(config, i, np.array([tick]))[0] for i in range(n)])
    grf = nominal_forces(stance).reshape(n, 4, 3) + 3.0 * stance[..., None]
    pairs = n * (n - 1) // 2
    return msg.Truth(
        tick,
        tick * 1_000_000,
        robot_names(n),
        pos,
        quat,
        vel,
        np.zeros((n, 3)),
        grf,
        np.full(pairs, -0.0004 * np.sin(tick / 1000)),
        np.zeros(pairs),
    )


def reference(config: Config, tick: int) -> msg.Reference:
    ramp = min(max((tick - config.gait.stand_ms) / 1000 / config.reference.ramp, 0.0), 1.0)
    vx, _, _, height = (getattr(config.reference, k) for k in ("vx", "vy", "wz", "height"))
    return msg.Reference(tick, tick * 1_000_000, ramp * vx, 0.0, 0.0, height)


def agent_messages(config: Config, index: int, tick: int) -> Iterator[Packet]:
    """What agent `index` sends in one tick."""
    key = f"team/r{index + 1}/"
    head = (tick, tick * 1_000_000)
    still, damping = np.zeros(12), np.ones(12)
    yield key + "command", msg.Command(*head, still, q_stand(), still, still, damping)
    stance = scheduled_stance(config, index, tick + 10 * np.arange(25))
    if tick % 10 == 0:
        u = nominal_forces(stance[0])
        y = outputs(tick, index) + ESTIMATOR_ERROR
        yield key + "measurement", msg.Measurement(*head, u, y, stance[0].astype(float))
    if tick % 40 == 0 and tick >= 400:
        y = np.array([outputs(tick + 10 * k + 10, index) for k in range(25)])
        used = {f"r{j + 1}": tick // 40 - 1 for j in range(config.team.robots) if j != index}
        yield (
            key + "plan",
            msg.Plan(*head, tick // 40, nominal_forces(stance), y, "solved", used, 0),
        )
    if tick % 100 == 0:
        solves = np.array([0.2, 0.3, 1.0]) if tick >= 400 else np.zeros(0)
        yield (
            key + "status",
            msg.Status(
                *head,
                "walk" if tick >= 300 else "stand",
                "",
                "kalman",
                {"state": 0.0},
                {"qp_fallback": tick // 1000},
                solves,
                np.array([50.0, 60.0]),
            ),
        )


def packets(config: Config, yaw: float) -> Iterator[Packet]:
    """All traffic of the run, in the order of a lock-step world."""
    zero, upright = np.zeros(12), np.array([1.0, 0.0, 0.0, 0.0])
    n, last = config.team.robots, round(1000 * config.world.duration)
    for tick in range(last + 1):
        head = (tick, tick * 1_000_000)
        if tick % 100 == 0:
            yield "team/reference", reference(config, tick)
        for i in range(n):
            yield (
                f"team/r{i + 1}/state",
                msg.State(*head, q_stand(), zero, zero, upright, zero[:3], zero[:3], zero[:4]),
            )
        if tick % 10 == 0:
            yield "team/sim/truth", truth(config, tick, yaw)
        if tick == last:
            return
        for i in range(n):
            yield from agent_messages(config, i, tick)


Change = Callable[[str, msg.Message], msg.Message | bytes | None]
WriteRun = Callable[..., Path]


def write(
    folder: Path,
    config: Config,
    *,
    yaw: float = 0.3,
    change: Change = lambda _, message: message,
    extra: Iterable[Packet] = (),
) -> Path:
    """Write a run into `folder` and return it.

    `change` is given key and message of all traffic and may return another message, raw bytes,
    or None to lose it; `extra` is sent at the end.
    """
    with RecordingWriter(folder / "run.mcap", build_metadata(config, "cd" * 32)) as writer:
        for key, message in chain(packets(config, yaw), extra):
            sent = change(key, message)
            if sent is not None:
                payload = sent if isinstance(sent, bytes) else encode(sent)
                writer.write(key, payload, WALL_0 + round(WALL * message.stamp_ns))
    return folder


@pytest.fixture
def write_run(tmp_path: Path) -> WriteRun:
    """The function `write` for a folder of the test's own."""
    return partial(write, tmp_path)


@pytest.fixture(scope="session")
def known_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole run, written once; tests may add files to its folder."""
    return write(tmp_path_factory.mktemp("known"), run_config())


def run_config(robots: int = 2, seconds: float = SECONDS) -> Config:
    """A short walk straight on."""
    return Config(
        team=TeamConfig(robots=robots),
        world=WorldConfig(duration=seconds, seed=7),
        reference=ReferenceConfig(vx=0.5, ramp=1.0),
    )
