"""A recorded walk up to a moment, and from there on by itself, with changed agents or world.

Up to that moment the recorded agents walk; the changed ones take in the same inputs beside them, so
that what they remember is what they would have remembered. The world is the changed one from the
beginning, and must equal the recorded one to the byte up to the moment: a push that comes later may
be another one, ground that the feet have felt before may not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.central_planner import collected_of
from quadriga.identification.rollout import Rollout, build_agents
from quadriga.recordings.by_tick import by_tick
from quadriga.replay.difference import Difference, find_difference
from quadriga.replay.world_replay import read_asked_faults
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.messages import Event, Reference, Truth
from quadriga.shared.recording.reader import Recording
from quadriga.shared.topics import SAMPLE_MS, STATE
from quadriga.sim_server.world.world import World
from quadriga.team.operator import references_of


@dataclass(frozen=True, slots=True)
class Change:
    """What is different from a moment on.

    Attributes:
        moment: a tick, ms.
        config: the changed configuration.
        predictor: of the changed agents; None if they need none.
        robots: whose agents are changed.
    """

    moment: int
    config: Config
    predictor: Predictor | None
    robots: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BranchTick:
    """A tick of the branch.

    Attributes:
        tick: its number, ms.
        truth: at its beginning, once a sample, else None.
        events: of the world in it.
        equal: states found equal to the recorded ones so far.
        parted: the first tick with a state that was not; None as long as all are equal.
    """

    tick: int
    truth: Truth | None
    events: tuple[Event, ...]
    equal: int
    parted: int | None


class _TwinAgent(Agent):
    """The recorded agent up to a moment, and from then on the changed one, which has listened."""

    def __init__(self, recorded: Agent, changed: Agent, moment: int) -> None:
        self._recorded, self._changed, self._moment = recorded, changed, moment
        self._listener = changed.initial()

    def initial(self) -> AgentState:
        return self._recorded.initial()

    def step(self, memory: AgentState, inputs: Inputs) -> tuple[AgentState, Outputs]:
        tick = inputs.state.tick
        if tick < self._moment:
            self._listener, _ = self._changed.step(self._listener, inputs)
            return self._recorded.step(memory, inputs)
        return self._changed.step(self._listener if tick == self._moment else memory, inputs)


def walk_branch(
    recording: Recording, config: Config, predictor: Predictor | None, change: Change
) -> Iterator[BranchTick]:
    """Walk until the changed `world.duration` are over, or a robot has fallen.

    Args:
        recording: of a walk in lock-step, in one simulated world.
        config: the recorded one.
        predictor: the agents' recorded one.
        change: what is different.

    Raises:
        RecordingError: the recorded walk does not come out again up to the moment.
        ConfigError: the changed world cannot be built.
    """
    agents = build_agents(config, predictor, collected=collected_of(config))
    if config != change.config or predictor is not change.predictor:
        data = collected_of(change.config)
        changed = build_agents(change.config, change.predictor, collected=data)
        for name in change.robots:
            agents[name] = _TwinAgent(agents[name], changed[name], change.moment)
    references = _choose_references(recording, config, change)
    rollout = Rollout(change.config, None, references, agents=agents)
    recorded = by_tick(recording, {STATE.name})
    asked = read_asked_faults(recording)
    last = round(1000 * change.config.world.duration)
    equal, parted = 0, None
    while rollout.world.tick < last and not rollout.world.fallen():
        if parted is None:
            entries = next(recorded, (0, []))[1]
            found = _compare(
                rollout.world, config.team.name, {entry.key: entry.payload for entry in entries}
            )
            if isinstance(found, Difference):
                _refuse_before(recording.path, found, change)
                parted = rollout.world.tick
            else:
                equal += found
        truth = rollout.world.truth() if rollout.world.tick % SAMPLE_MS == 0 else None
        for fault in asked.get(rollout.world.tick, ()):
            rollout.world.add_fault(fault)
        tick = rollout.step()
        yield BranchTick(tick.tick, truth, tick.events, equal, parted)


def _choose_references(
    recording: Recording, config: Config, change: Change
) -> Callable[[int], Reference | None]:
    """The recorded references, and where there are none or others are asked for the operator's."""
    recorded = {reference.tick: reference for reference in recording.messages(Reference)}
    asked, last = references_of(change.config), max(recorded, default=-1)
    same = config.reference == change.config.reference

    def choose(tick: int) -> Reference | None:
        if tick <= last and (same or tick < change.moment):
            return recorded.get(tick)
        return asked(tick)

    return choose


def _compare(world: World, team: str, recorded: Mapping[str, bytes]) -> int | Difference:
    """Number of states of this tick that are equal to the recorded ones, or the first that is not.

    One that was not recorded is nothing to compare with.
    """
    count = 0
    for name, state in world.states().items():
        key = STATE.key(team, name)
        if key in recorded:
            if encode(state) != recorded[key]:
                return find_difference(world.tick, key, recorded[key], state)
            count += 1
    return count


def _refuse_before(path: Path, found: Difference, change: Change) -> None:
    """Refuse a walk that is another one before the moment.

    Raises:
        RecordingError: it is.
    """
    if found.tick <= change.moment:
        raise RecordingError(
            str(path),
            f"another walk: {found}",
            f"the recorded one up to {1e-3 * change.moment:g} s",
            "the change is felt before, the walk was acted on from outside (a process that was "
            "lost, an emergency stop), or it was recorded with other versions",
        )
