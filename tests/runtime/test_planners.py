"""Every kind of planner over the bus sends what the same team sends in one process, to the byte."""

from __future__ import annotations

import os
import signal
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from quadriga.agents.gait import first_step, step_ms
from quadriga.agents.planning.references import AHEAD_MS
from quadriga.agents.predictor.gates import load_checked as load_predictor
from quadriga.identification.central_planner import build_central_planner
from quadriga.identification.predictors import ensure_predictor
from quadriga.identification.rollout import Rollout
from quadriga.shared.bus.liveness import LAST_PACKETS
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.messages import Event, Plan
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.topics import CLOCK, EVENT
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.operator import reference_at
from tests.golden.compare import first_difference
from tests.runtime.conftest import DATA, await_tick

pytestmark = pytest.mark.usefixtures("_compiled")

ROBOTS, SECONDS = 2, 1.2
KINDS: dict[str, dict[str, object]] = {
    "centralised": {"planner.kind": "centralised", "planner.latency_ms": 8},
    "deepc": {"planner.kind": "deepc"},
    "fast": {"planner.preset": "fast"},
    "cooperative": {"planner.cost": "team", "planner.exchanges": 1},
    "exchanged": {"planner.exchanges": 2, "planner.compensation": True, "planner.damping": 0.2},
}


def config_of(kind: str) -> Config:
    given: dict[str, object] = {
        "team.robots": ROBOTS,
        "world.duration": SECONDS,
        "world.seed": 4,
        "bus.endpoint": free_endpoint(),
        **DATA,
        **KINDS[kind],
    }
    return load(None, given)


def in_one_process(config: Config, predictor: Path) -> dict[str, list[bytes]]:
    """Commands, measurements and (of agents that make them) plans, by key."""
    fitted, central = load_predictor(predictor, config)[0], find_kind(config.planner.kind).central
    rollout = Rollout(
        config,
        None if central else fitted,
        lambda tick: reference_at(config, tick) if tick % 100 == 0 else None,
        planner=build_central_planner(config, fitted) if central else None,
    )
    sent: dict[str, list[bytes]] = defaultdict(list)
    for tick in rollout.ticks(round(1000 * SECONDS)):
        for name, outputs in tick.outputs.items():
            for topic in ("command", "measurement", "plan"):
                message = getattr(outputs, topic)
                if message is not None:
                    sent[f"team/{name}/{topic}"].append(encode(message))
    return sent


def over_the_bus(config: Config, predictor: Path, folder: Path) -> dict[str, list[bytes]]:
    """Everything recorded, by key."""
    (folder / "config.toml").write_text(to_toml(config), encoding="utf-8")
    with Launch(process_table(config, folder, predictor, ""), folder / "logs") as running:
        running.watch(lambda: False)
    sent: dict[str, list[bytes]] = defaultdict(list)
    for entry in Recording(folder / "run.mcap").entries():
        sent[entry.key].append(entry.payload)
    return sent


@pytest.mark.parametrize("kind", KINDS)
def test_the_bus_changes_nothing(kind: str, tmp_path: Path) -> None:
    config = config_of(kind)
    predictor = ensure_predictor(config, Console(stderr=True))
    alone, together = in_one_process(config, predictor), over_the_bus(config, predictor, tmp_path)
    for key, payloads in alone.items():
        sent = [(key, payload) for payload in together[key]]
        assert first_difference([(key, payload) for payload in payloads], sent) is None
    for name in robot_names(ROBOTS):
        exchanges = config.planner.exchanges + 1
        begin = first_step(config) * step_ms(config)
        steps = len(range(begin, round(1000 * SECONDS), step_ms(config)))
        assert len(together[f"team/{name}/plan"]) == pytest.approx(steps * exchanges, abs=exchanges)
        assert len(alone[f"team/{name}/command"]) == 1000 * SECONDS


def test_a_central_planner_outlives_a_false_end_and_a_pause_after_it(tmp_path: Path) -> None:
    """Who believes in an end leaves as soon as the world has been silent for a while."""
    config = config_of("centralised")
    config = replace(config, world=replace(config.world, duration=3.0))
    predictor = ensure_predictor(config, Console(stderr=True))
    (tmp_path / "config.toml").write_text(to_toml(config), encoding="utf-8")
    with (
        Launch(process_table(config, tmp_path, predictor, ""), tmp_path / "logs") as running,
        Bus.open(config.bus, config.team.name, "watcher") as bus,
    ):
        bus.subscribe(CLOCK.key(config.team.name))
        now = await_tick(bus, 1000, CLOCK)
        false = Event.of(1 << 41, "signal", "", "forged")
        bus.publisher(EVENT.key(config.team.name))(encode(false))
        await_tick(bus, now + AHEAD_MS + 200, CLOCK)
        os.kill(running.pids["sim"], signal.SIGSTOP)
        sleep(LAST_PACKETS + 0.5)
        os.kill(running.pids["sim"], signal.SIGCONT)
        running.watch(lambda: False)
    steps = [plan.step for plan in Recording(tmp_path / "run.mcap").messages(Plan, "r1")]
    assert steps[-1] == (3000 - 1) // step_ms(config)
