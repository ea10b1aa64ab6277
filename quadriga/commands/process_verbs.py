"""The commands that are processes of a team, or speak to one, one function each.

Each imports what it needs: a process should start fast.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rich.console import Console

from quadriga.commands.verbs import Given, report
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.runtime.signals import stop_flag

if TYPE_CHECKING:
    from quadriga.agents.predictor.predictor import Predictor


def sim(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """The sim server's process."""
    from quadriga.sim_server.process import run

    run(config)
    return 0


def agent(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """One agent's process."""
    from quadriga.agents.process import run

    names = robot_names(config.team.robots)
    if arguments.robot not in names:
        raise ConfigError("--robot", repr(arguments.robot), f"one of {', '.join(names)}")
    predictor = None
    if config.planner.kind not in ("none", *CENTRAL):
        predictor = _predictor(config, arguments)
    run(config, arguments.robot, predictor)
    return 0


def plan(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """The process of a planner that plans for the whole team."""
    from quadriga.agents.central_process import run
    from quadriga.identification.identify import team_planner

    if config.planner.kind not in CENTRAL:
        raise ConfigError(
            "planner.kind",
            repr(config.planner.kind),
            f"one of {', '.join(CENTRAL)}",
            "in all other kinds each agent plans for itself",
        )
    run(config, team_planner(config, _predictor(config, arguments)))
    return 0


def record(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """The recorder's process."""
    from quadriga.commands.recording_verbs import recorded, wanted
    from quadriga.recorder.process import run
    from quadriga.recordings.summary import RECORDING

    path, choice = arguments.output, wanted(arguments)
    if path is None:
        from quadriga.team.run_folder import make_run_dir

        path = make_run_dir(None) / RECORDING
    elif arguments.report and path.name != RECORDING:
        raise ConfigError("--output", str(path), f"DIR/{RECORDING}", "--report fills its folder")
    sha256 = arguments.predictor_sha256 or _fitted_sha256(config, arguments.wait)
    say = Console(stderr=True, markup=False, highlight=False, soft_wrap=True).print
    with stop_flag() as stopped:
        done = run(config, path, predictor_sha256=sha256, stopped=stopped, wanted=choice, say=say)
        if stopped() or not arguments.report:
            print(recorded(done))
            return 0
    arguments.run, arguments.html = path.parent, None
    return report(arguments, config, given)


def operate(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """The operator's process."""
    from quadriga.team.operator import run

    run(config)
    return 0


def estop(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """One emergency stop."""
    from quadriga.team.operator import stop_team

    stop_team(config, arguments.reason)
    return 0


def router(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """The router's process."""
    from quadriga.team.router import run

    run(config, arguments.listen or config.bus.endpoint, once=arguments.once)
    return 0


def _predictor(config: Config, arguments: argparse.Namespace) -> Predictor:
    """The predictor of `--predictor`, or this machine's for `config`, once it is there."""
    from quadriga.agents.predictor.store import load
    from quadriga.identification.cache import await_predictor, predictor_path

    path = arguments.predictor or predictor_path(config)
    if arguments.wait:
        await_predictor(path, arguments.wait)
    return load(path, config)[0]


def _fitted_sha256(config: Config, wait: float) -> str:
    """Digest of this machine's predictor for `config`, "" if there is none."""
    if config.planner.kind == "none":
        return ""
    from quadriga.agents.predictor.store import load, predictor_sha256
    from quadriga.identification.cache import await_predictor, predictor_path

    path = predictor_path(config)
    if wait:
        await_predictor(path, wait)
    return predictor_sha256(load(path, config)[0]) if path.is_file() else ""
