"""SHELL of the simulated team that speaks the robots' own protocols, in real time."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from quadriga.shared.config.sections import Config
from quadriga.shared.printable import printable_line
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.runtime.collector import end_collection
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.wire.codes import FALL
from quadriga.sim_server.native.board import Board
from quadriga.sim_server.native.console import Console
from quadriga.sim_server.native.hanger import Hanger
from quadriga.sim_server.native.news import LostTime, News
from quadriga.sim_server.native.open_boards import open_boards
from quadriga.sim_server.native.orders import parse_order
from quadriga.sim_server.native.steering import Steering
from quadriga.sim_server.native.truth_log import PERIOD_MS, TruthLog
from quadriga.sim_server.world.world import World

_TICK: Final = 1e-3  # s
_STDIN: Final = 0


@dataclass(frozen=True)
class NativeTask:
    """What else simulated robots are to do.

    Attributes:
        hung: whether they hang in the air from the start.
        orders: lines of orders that they get at the start.
        truth: where to write where they truly are; None: nowhere.
    """

    hung: bool = False
    orders: Sequence[str] = ()
    truth: Path | None = None


def run(
    config: Config, task: NativeTask | None = None, stopped: Callable[[], bool] | None = None
) -> None:
    """Be the robots until told to stop. They lie on the ground at first, or hang.

    Lines on the standard input are orders, see `orders`.

    Args:
        config: the team's configuration; `bridge.endpoint`, or `bridge.interface`
            and `bridge.domain`, say where each robot is.
        task: what else; by default nothing.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.

    Raises:
        ConfigError: an address does not parse or is missing, an order is none, or the file for the
            truth cannot be written.
        BridgeError: a port is taken, or there is no such interface.
    """
    stopped, task = stopped or stop_on_signals(), task or NativeTask()
    orders = [parse_order(line, robot_names(config.team.robots)) for line in task.orders]
    world = World(replace(config, world=replace(config.world, spawn="lying")))
    hanger = Hanger(world)
    if task.hung:
        hanger.spawn_hung()
    with ExitStack() as stack:
        log = stack.enter_context(TruthLog(task.truth, world.names)) if task.truth else None
        boards = open_boards(config)
        for board in boards.values():
            stack.callback(board.close)
        steering = Steering(boards, hanger, Console(_STDIN), orders, _say)
        _serve(_Served(world, boards, hanger, steering, log), config, stopped)


@dataclass(frozen=True)
class _Served:
    world: World
    boards: Mapping[str, Board]
    hanger: Hanger
    steering: Steering
    log: TruthLog | None


def _serve(served: _Served, config: Config, stopped: Callable[[], bool]) -> None:
    world, boards, log = served.world, served.boards, served.log
    news = News(world, config.robot.stand_height, config.robot.feet_under_hips)
    end_collection()
    take_priority(config.runtime.priority)
    rate, lost = Rate(_TICK, slack=3.0), LostTime()
    _say(f"{len(boards)} simulated {config.robot.title} on the network")
    while not stopped():
        if log is not None and world.tick % PERIOD_MS == 0:
            log.note(world.truth())
        served.steering.turn(world.tick)
        states = world.states()
        for k, (name, board) in enumerate(boards.items()):
            board.report(states[name], world.motors.heat[k])
        rate.wait()
        commands = {name: board.obey() for name, board in boards.items()}
        for line in news.of_motors(commands):
            _say(line)
        served.hanger.hold()
        for event in world.step({n: c for n, c in commands.items() if c is not None}):
            if event.code != FALL:  # the news has them, but for robots that have never stood
                _say(f"{event.tick} ms: {event.kind} {event.robot} {event.detail}")
        for line in news.of_postures(served.hanger.hung):
            _say(line)
        if line := lost.look(world.tick, rate.lost):
            _say(line)
        world.settle()
    for line in news.rest():
        _say(line)
    _say(f"{world.tick} ms: end, {rate.overruns} ticks began late")


def _say(text: str) -> None:
    print(printable_line(text), file=sys.stderr, flush=True)
