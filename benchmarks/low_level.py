"""Time of one robot's low-level tick and of its stages, on the ticks of a real walk.

A tick is everything between the bytes of a state and the bytes of the command: decode, estimate,
gait and plan in force, rigid-body terms, references and QP, encode. Hot means one tick after the
other. Cold means that an array larger than the caches is read between two ticks, since in a walk
the world and other robots run in between and empty the caches.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.low_level_ticks import AgentTick
from quadriga.agents import agent as agent_module
from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.runtime.scheduling import collector_off

STAGES: Final = ("decode", "estimate", "gait, plan", "control", "encode")
_L2: Final = Path("/sys/devices/system/cpu/cpu0/cache/index2/size")
_Stopwatch = defaultdict[str, int]  # nanoseconds spent, by name
_SIZE: Final = 8 << 20  # B, more than any L2 cache, where the system does not state its size


def measure(
    config: Config, predictor: Predictor | None, ticks: list[AgentTick], passes: int = 3
) -> dict[str, Any]:
    """Medians and p99 of the whole tick and of its stages, µs, hot and cold.

    Only ticks after the stand count. Each pass replays the walk from its start, since an agent has
    a state. The stages are measured in passes of their own, so that the whole tick does not include
    the stopwatch.
    """
    first = config.gait.stand_ms
    figures: dict[str, Any] = {"ticks": len(ticks) - first, "robots": config.team.robots}
    agent = Agent(config, "r1", predictor)
    watch = _Stopwatch(int)
    timed = Agent(config, "r1", predictor)
    between = {"hot": lambda: None, "cold": _evict()}
    with collector_off():
        _replay(agent, ticks)  # first calls load and set up
        for name, evict in between.items():
            whole = [_replay(agent, ticks, evict)[first:] for _ in range(passes)]
            with _timed("estimate", watch), _timed("control", watch):
                parts = [_time_stages(timed, watch, ticks, evict)[first:] for _ in range(passes)]
            times, stages = np.concatenate(whole), np.concatenate(parts)
            figures[name] = {
                "median": float(np.median(times)),
                "p99": float(np.percentile(times, 99)),
                "stages": dict(zip(STAGES, np.median(stages, axis=0).tolist(), strict=True)),
            }
    return figures


def _replay(
    agent: Agent, ticks: list[AgentTick], evict: Callable[[], object] = lambda: None
) -> Array:
    """Time of every tick, µs; `evict` is called before each."""
    times, memory = np.empty(len(ticks)), agent.initial()
    for k, tick in enumerate(ticks):
        evict()
        begun = monotonic_ns()
        memory, outputs = _step(agent, memory, tick, decode(tick.payload, State))
        encode(outputs.command)
        times[k] = monotonic_ns() - begun
    return 1e-3 * times


def _time_stages(
    agent: Agent, watch: _Stopwatch, ticks: list[AgentTick], evict: Callable[[], object]
) -> Array:
    """Time of every tick's stages, (T, 5), µs."""
    times, memory = np.empty((len(ticks), len(STAGES))), agent.initial()
    for k, tick in enumerate(ticks):
        evict()
        watch.clear()
        begun = monotonic_ns()
        state = decode(tick.payload, State)
        decoded = monotonic_ns()
        memory, outputs = _step(agent, memory, tick, state)
        stepped = monotonic_ns()
        encode(outputs.command)
        ended = monotonic_ns()
        estimate, control = watch["estimate"], watch["control"]
        rest = stepped - decoded - estimate - control
        times[k] = decoded - begun, estimate, rest, control, ended - stepped
    return 1e-3 * times


def _step(
    agent: Agent, memory: AgentState, tick: AgentTick, state: State
) -> tuple[AgentState, Outputs]:
    received = tick.inputs
    return agent.step(
        memory, Inputs(state, received.measurements, received.plans, received.references)
    )


def _evict() -> Callable[[], object]:
    """A function that evicts from the caches whatever they held before its call."""
    size = _SIZE
    if _L2.is_file():
        kibibytes = _L2.read_text(encoding="ascii").strip().removesuffix("K")
        size = 2 * 1024 * int(kibibytes) if kibibytes.isdigit() else size
    return np.ones(size // 8).sum


@contextmanager
def _timed(name: str, watch: _Stopwatch) -> Iterator[None]:
    """Have a function that agents call timed at each call."""
    function = getattr(agent_module, name)

    def run(*arguments: Any, **named: Any) -> Any:
        begun = monotonic_ns()
        result = function(*arguments, **named)
        watch[name] += monotonic_ns() - begun
        return result

    setattr(agent_module, name, run)
    try:
        yield
    finally:
        setattr(agent_module, name, function)
