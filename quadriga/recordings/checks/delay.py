"""The one-step communication delay: of which step were the peers' plans that each plan used?"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.gait import step_ms
from quadriga.agents.planner.cooperation import is_cooperative
from quadriga.agents.planner.solver import SOLVED
from quadriga.recordings.checks.finding import CheckedMessage, Finding
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Plan, Status
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import neighbours, robot_names

GIVEN_UP: Final = "waits_given_up"  # the agent's count of messages it no longer waited for
_NO_ARRAY: Final = np.zeros((0, 0))
Violation = tuple[str, str]  # got, limit


class Delay:
    """A plan of step k used its peers' plans of step k−1, never a later one.

    One made in the e-th exchange within a step used those of step k. An older one may be used
    where that of step k−1 had not come: in lock-step only if the recording has none or the agent
    has given up waiting, and never a solved plan with one older than the configuration allows.
    A central planner uses every robot's measurements of step k; who plans alone uses nothing.
    """

    def __init__(self, config: Config, *, whole: bool) -> None:
        """Begin.

        Args:
            config: the team's configuration.
            whole: whether the recording is; else, as in real time, where messages may be dropped
                on their way to the recorder, plans that were used need not be in it.
        """
        self._whole = whole and config.world.mode == "lockstep"
        self._unproven = 0
        self.finding = Finding("delay", "plans")
        self._config, self._step_ms = config, step_ms(config)
        names = robot_names(config.team.robots)
        self._peers = {name: _peers(config, i, names) for i, name in enumerate(names)}
        self._plans: list[tuple[str, str, Plan]] = []
        self._steps: defaultdict[str, set[int]] = defaultdict(set)
        self._impatient: set[str] = set()
        self._older = 0

    def look(self, item: CheckedMessage) -> None:
        plan = item.message
        if isinstance(plan, Status) and plan.counters.get(GIVEN_UP):
            self._impatient.add(item.robot)
        if isinstance(plan, Plan) and item.robot in self._peers:
            self._steps[item.robot].add(plan.step)
            light = replace(plan, u=_NO_ARRAY, y=_NO_ARRAY)  # all of a long walk's are kept
            self._plans.append((item.key, item.robot, light))

    def finish(self) -> None:
        """Hold every plan against the rule."""
        for key, robot, plan in self._plans:
            self.finding.looked += 1
            for got, limit in self._find_violations(robot, plan):
                self.finding.add_objection(plan.tick, key, got, limit)
        if self._older:
            self.finding.notes.append(f"{self._older} older plans of peers used, and said so")
        if self._unproven and not self._whole:
            self.finding.notes.append(f"{self._unproven} plans of peers used that are not recorded")
        if self._impatient:
            names = ", ".join(sorted(self._impatient))
            self.finding.notes.append(f"no longer waited for everyone: {names}")

    def _find_violations(self, robot: str, plan: Plan) -> Iterator[Violation]:
        config = self._config
        if plan.tick != plan.step * self._step_ms:
            yield f"step {plan.step}", f"step {plan.tick / self._step_ms:g} at this tick"
        if plan.exchange > config.planner.exchanges:
            yield f"exchange {plan.exchange}", f"at most {config.planner.exchanges}"
        if find_kind(config.planner.kind).central:
            expected = dict.fromkeys(self._peers, plan.step)
            if plan.used != expected:
                yield f"used {plan.used}", f"{expected}"
            return
        last = plan.step if plan.exchange else plan.step - 1
        for peer, step in plan.used.items():
            if peer not in self._peers[robot]:
                yield f"used a plan of {peer}", f"of {', '.join(self._peers[robot]) or 'none'}"
            elif step > last:
                yield f"used step {step} of {peer}", f"step {last}"
            else:
                yield from self._check_older(robot, plan, peer, step, last)
        for peer in self._peers[robot]:
            if peer not in plan.used and self._must_be_used(robot, peer, last):
                yield f"used none of {peer}", f"step {last}"

    def _check_older(
        self, robot: str, plan: Plan, peer: str, step: int, last: int
    ) -> Iterator[Violation]:
        """What is wrong with the use of a plan that is not newer than allowed."""
        steps, planner = self._steps[peer], self._config.planner
        if steps and step not in steps and step > min(steps):
            if self._whole:
                yield f"used step {step} of {peer}, which is not recorded", f"step {last}"
            self._unproven += 1
        elif step < last:
            if self._must_be_used(robot, peer, last):
                yield f"used step {step} of {peer}", f"step {last}, which was there"
                return
            self._older += 1
            age = last - step
            if plan.status == SOLVED and age > planner.max_peer_age + planner.hold_steps:
                oldest = last - planner.max_peer_age - planner.hold_steps
                yield f"used step {step} of {peer}", f"step {oldest} or later"

    def _must_be_used(self, robot: str, peer: str, last: int) -> bool:
        """Whether the peer's plan of step `last` was there, so that it must have been used."""
        lockstep = self._config.world.mode == "lockstep"
        return lockstep and robot not in self._impatient and last in self._steps[peer]


def _peers(config: Config, index: int, names: tuple[str, ...]) -> tuple[str, ...]:
    """Robots whose plans matter to one that plans for itself."""
    if not find_kind(config.planner.kind).needs_peers:
        return ()
    if config.identification.neighbours == "yoked":
        near = {*neighbours(len(names), config.team.yokes, index)}
        if is_cooperative(config):
            # Those count too whose forces matter to the outputs of a neighbour.
            near |= {k for j in near for k in neighbours(len(names), config.team.yokes, j)}
        return tuple(names[j] for j in sorted(near) if j != index)
    return tuple(name for j, name in enumerate(names) if j != index)
