"""Contradictions between keys of a configuration, and rules that a range cannot say."""

from __future__ import annotations

import re
from typing import Final

from quadriga.shared.config.endpoints import check_port
from quadriga.shared.config.friction import friction_of_robots
from quadriga.shared.config.payload import carriers
from quadriga.shared.config.sections import (
    BRIDGED,
    SIMULATED,
    Config,
    GaitConfig,
    MotorsConfig,
    PlannerConfig,
    WorldConfig,
)
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.controller_line import parse_line
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import NO_PLANNER, find_kind, read_options
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import SAMPLE_MS

_TEAM_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_PAIRS: Final = (
    "identification.vx",
    "identification.vy",
    "identification.wz",
    "identification.gain_range",
)
_ANSWER: Final = 1.0  # s wall, for a robot's step once it has waited for a peer in vain


def check(config: Config) -> None:
    """Rules that need more than one key, or more than a range.

    Raises:
        ConfigError: a rule is broken; the first one that is.
    """
    _check_team_name(config.team.name)
    check_port("bus.endpoint", config.bus.endpoint)
    _check_gait(config.gait)
    _check_world(config.world, robot_names(config.team.robots))
    _check_motors(config.motors)
    _check_planner(config.planner, config.world)
    _check_plants(config)
    _check_controller(config)
    _check_pairs(config)
    _check_response(config)


def _check_team_name(name: str) -> None:
    if not _TEAM_NAME.fullmatch(name):
        raise ConfigError(
            "team.name",
            repr(name),
            "1 to 64 letters, digits, . _ or -",
            "it is the first part of every key",
        )


def _check_gait(gait: GaitConfig) -> None:
    for name, value in (("stance_ms", gait.stance_ms), ("stand_ms", gait.stand_ms)):
        if value % SAMPLE_MS:
            raise ConfigError(
                f"gait.{name}", str(value), f"a multiple of {SAMPLE_MS} ms", "the planner's samples"
            )


def _check_world(world: WorldConfig, names: tuple[str, ...]) -> None:
    carriers(world.payload_on, names)
    friction_of_robots(world.friction_of, world.friction, names)
    for push in filter(None, world.push.split(",")):
        robot = push.partition(":")[0].strip()
        if robot not in ("all", *names):
            raise ConfigError(
                "world.push", f"a push on {robot!r}", f"all or one of {', '.join(names)}"
            )
    if world.command_damp_ms < world.command_hold_ms:
        raise ConfigError(
            "world.command_damp_ms",
            str(world.command_damp_ms),
            f"at least world.command_hold_ms = {world.command_hold_ms}",
            "a late command is held first, then damped",
        )
    terrain = TERRAINS[world.terrain]
    height = getattr(world, terrain.height_key)
    if height < terrain.least_height:
        raise ConfigError(
            f"world.{terrain.height_key}",
            f"{height:g}",
            f"at least {terrain.least_height:g} m for terrain {terrain.name!r}",
            "terrain 'flat' has no height",
        )


def _check_motors(motors: MotorsConfig) -> None:
    friction = max(motors.friction, motors.viscous_friction)
    if friction > 0.0 and not motors.rotor_inertia:
        raise ConfigError(
            "motors.rotor_inertia",
            f"false with joint friction of {friction:g}",
            "true, or motors.friction = 0 and motors.viscous_friction = 0",
            "friction of light joints turns their rates around at every tick",
        )


def _check_planner(planner: PlannerConfig, world: WorldConfig) -> None:
    """The kind is installed; plans reach from one to the next; a peer is waited for."""
    kind = find_kind(planner.kind)
    read_options(kind, planner.options)
    if planner.applied > planner.N:
        raise ConfigError(
            "planner.applied", str(planner.applied), f"at most planner.N = {planner.N}"
        )
    if not kind.publishes:
        return
    if -1.0 < planner.damping < 0.0:
        raise ConfigError("planner.damping", f"{planner.damping:g}", "-1, or 0 … 0.95")
    if planner.cost == "team" and kind.needs_peers:
        _check_cooperation(planner)
    latency = max(1, planner.latency_ms) if kind.central else planner.latency_ms
    longest = SAMPLE_MS * (planner.N - planner.applied)
    if latency > longest:
        raise ConfigError(
            "planner.latency_ms",
            str(planner.latency_ms),
            f"at most {SAMPLE_MS}·(planner.N − planner.applied) = {longest} ms",
            "a plan would have run out before the next one takes effect",
        )
    least = planner.peer_timeout + _ANSWER
    if world.mode == "lockstep" and world.command_timeout < least:
        raise ConfigError(
            "world.command_timeout",
            f"{world.command_timeout:g}",
            f"at least planner.peer_timeout + {_ANSWER:g} s = {least:g} s",
            "else robots that wait for a frozen peer's plan count as frozen too",
        )


def _check_cooperation(planner: PlannerConfig) -> None:
    """What a plan for the whole team cannot heed: other agents' outputs."""
    if planner.output_bounds != "none":
        raise ConfigError(
            "planner.output_bounds",
            f"{planner.output_bounds!r} with planner.cost 'team'",
            "'none', or planner.cost = 'own'",
            "each agent would plan with bounds that its peers do not know",
        )


def _check_plants(config: Config) -> None:
    """What plants of a robot each cannot do: be yoked in simulation, or know the whole truth."""
    team = config.team
    if team.plant == BRIDGED:
        _check_bridged(config)
    if not team.plant_per_robot:
        return
    if config.estimator.kind == "truth":
        raise ConfigError(
            "estimator.kind",
            "'truth' with team.plant_per_robot = true",
            "'kalman', or team.plant_per_robot = false",
            "the plant of one robot does not know where all are",
        )
    if team.plant == SIMULATED and team.robots > 1 and team.yokes != "none":
        raise ConfigError(
            "team.plant_per_robot",
            f"true with simulated robots and {team.yokes!r} yokes",
            "team.yokes = 'none', or team.plant_per_robot = false",
            "robots that are simulated in worlds of their own cannot pull at each other",
        )


def _check_bridged(config: Config) -> None:
    """Robots have a bridge each, and their own time."""
    for name, value, wanted, cause in (
        (
            "team.plant_per_robot",
            str(config.team.plant_per_robot).lower(),
            "true",
            "every robot has a bridge of its own",
        ),
        ("world.mode", config.world.mode, "realtime", "robots do not wait for a command"),
    ):
        if value != wanted:
            raise ConfigError(name, f"{value} with team.plant {BRIDGED!r}", wanted, cause)


def _check_controller(config: Config) -> None:
    """A controller of one's own has a command line, and nobody else plans for its robots."""
    line, kind = config.team.agent_command, config.planner.kind
    if not line:
        return
    parse_line(line)
    if kind != NO_PLANNER:
        raise ConfigError(
            "planner.kind",
            f"{kind!r} with team.agent_command {line!r}",
            f"{NO_PLANNER!r}, or team.agent_command = ''",
            "a controller of one's own takes the place of agents and planners",
        )


def _check_pairs(config: Config) -> None:
    for pair in _PAIRS:
        section, _, key = pair.partition(".")
        first, last = getattr(getattr(config, section), key)
        if first > last:
            raise ConfigError(pair, f"[{first}, {last}]", "[least, greatest]")


def _check_response(config: Config) -> None:
    ident = config.identification
    if ident.response and ident.predictor != "periodic":
        raise ConfigError(
            "identification.response",
            f"{ident.response!r} with the predictor {ident.predictor!r}",
            "identification.predictor = 'periodic'",
            "no other is made of responses to single forces",
        )
