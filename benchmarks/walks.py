"""Real walks, process by process over the bus, and the same walks in one process without it."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.identification.rollout import Rollout
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.messages import Truth
from quadriga.shared.runtime.clock import monotonic, monotonic_ns
from quadriga.shared.runtime.scheduling import collector_off
from quadriga.shared.topics import TRUTH
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.operator import references_of
from quadriga.team.run_folder import CONFIG


def alone(config: Config, predictor: Predictor | None) -> dict[str, float]:
    """Mean time of a tick in this process, µs: the whole, and its parts one after the other."""
    rollout = Rollout(config, predictor, references_of(config))
    timed = [_TimedWalk(Agent(config, n, predictor, monotonic_ns)) for n in rollout.world.names]
    rollout.agents = dict(zip(rollout.world.names, timed, strict=True))
    with collector_off():
        rollout.step()  # the first one loads
        for agent in timed:
            agent.ns = agent.planner_ns = 0
        begun, ticks = monotonic_ns(), 0
        for _ in rollout.ticks(round(1000 * config.world.duration) - 1):
            ticks += 1
        took = monotonic_ns() - begun
    spent, planners = sum(a.ns for a in timed), sum(a.planner_ns for a in timed)
    share = 1e-3 / max(ticks, 1)
    return {
        "tick_us": share * took,
        "physics_us": share * (took - spent),
        "controllers_us": share * (spent - planners),
        "planners_us": share * planners,
        "ticks": ticks,
    }


def over_the_bus(
    config: Config, file: Path | None, predictor: Predictor | None, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Walk as `quadriga walk` does: real-time factor, µs of a tick, memory of each process.

    Args:
        config: the team's configuration; its endpoint is replaced by a free one.
        file: of the predictor; None without a planner.
        predictor: the content of the file.
        tell: called with the progress of the walk.

    Raises:
        ProcessError: a process failed or left too early.
    """
    config = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
    sha256 = "" if predictor is None else predictor_sha256(predictor)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / CONFIG).write_text(to_toml(config), encoding="utf-8")
        rows = process_table(config, folder, file, sha256)
        memory: dict[str, dict[str, float]] = {}
        with Launch(rows, folder / "logs") as launch, _Watch(config) as watch:

            def look() -> bool:
                tell(f"{watch.seconds:.1f}/{config.world.duration:g} s")
                if not memory and watch.seconds > 0.5 * config.world.duration:
                    memory.update({name: _memory(pid) for name, pid in launch.pids.items()})
                return False

            launch.watch(look)
    factor = watch.factor()
    return {"rtf": factor, "tick_us": 1e3 / factor, "seconds": watch.seconds, "memory_mb": memory}


def _memory(pid: int) -> dict[str, float]:
    """Resident memory of a process, and its share where processes share pages, MB."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    except OSError:  # it has just left
        return {}
    fields = {row.split(":")[0]: row.split()[1] for row in text.splitlines()[1:]}
    return {"rss": 1024e-6 * int(fields["Rss"]), "pss": 1024e-6 * int(fields["Pss"])}


class _TimedWalk(Agent):
    """An agent whose steps, and its planner's part of them, are timed."""

    def __init__(self, agent: Agent) -> None:
        self._agent, self.ns, self.planner_ns = agent, 0, 0

    def initial(self) -> AgentState:
        return self._agent.initial()

    def step(self, state: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        begun = monotonic_ns()
        state, outputs = self._agent.step(state, inputs)
        self.ns += monotonic_ns() - begun
        self.planner_ns += outputs.planner_ns or 0
        return state, outputs


class _Watch:
    """Notes when each ground truth arrives, to measure the world's speed without a recorder too."""

    def __init__(self, config: Config) -> None:
        self._bus = Bus.open(config.bus, config.team.name, "bench")
        self._bus.subscribe(TRUTH.key(config.team.name))
        self._seen: list[tuple[float, float]] = []  # world time, clock, s
        self._over = False
        self._thread = threading.Thread(target=self._listen, daemon=True)

    @property
    def seconds(self) -> float:
        """World time of the newest ground truth."""
        return self._seen[-1][0] if self._seen else 0.0

    def factor(self) -> float:
        """World time over elapsed time."""
        (world, clock), (world_end, clock_end) = self._seen[0], self._seen[-1]
        return (world_end - world) / (clock_end - clock)

    def _listen(self) -> None:
        while not self._over:
            packet = self._bus.get(0.1)
            if packet is not None:
                self._seen.append((1e-3 * decode(packet[1], Truth).tick, monotonic()))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over = True
        self._thread.join()
        self._bus.close()
