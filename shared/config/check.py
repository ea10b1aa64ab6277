"""Contradictions between keys of a configuration, and rules that a range cannot say."""

from __future__ import annotations

import re
from typing import Final

from quadriga.shared.agent_command import parse_line
from quadriga.shared.config.endpoints import check_port
from quadriga.shared.config.per_robot import carriers, friction_of_robots
from quadriga.shared.config.sections import BRIDGED, SIMULATED, Config, PlannerConfig, WorldConfig
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import NO_PLANNER, find_kind, read_options
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import SAMPLE_MS

_TEAM_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_RANGES: Final = ("vx", "vy", "wz", "gain_range")  # of [identification]
_ANSWER: Final = 1.0  # s wall, for a robot's step once it has waited for a peer in vain


def check(config: Config) -> None:
    """Rules that need more than one key, or more than a range.

    Raises:
        ConfigError: a rule is broken; the first one that is.
    """
    name = config.team.name
    if not _TEAM_NAME.fullmatch(name):
        expected, cause = "1 to 64 letters, digits, . _ or -", "it is the first part of every key"
        raise ConfigError("team.name", repr(name), expected, cause)
    check_port("bus.endpoint", config.bus.endpoint)
    for key in ("stance_ms", "stand_ms"):
        if (value := getattr(config.gait, key)) % SAMPLE_MS:
            raise ConfigError(f"gait.{key}", str(value), f"a multiple of {SAMPLE_MS} ms")
    _check_world(config.world, robot_names(config.team.robots))
    _check_models(config)
    _check_planner(config.planner, config.world)
    _check_plants(config)
    _check_agent_command(config)
    _check_identification(config)


def _check_world(world: WorldConfig, names: tuple[str, ...]) -> None:
    carriers(world.payload_on, names)
    friction_of_robots(world.friction_of, world.friction, names)
    for push in filter(None, world.push.split(",")):
        robot = push.partition(":")[0].strip()
        if robot not in ("all", *names):
            expected = f"all or one of {', '.join(names)}"
            raise ConfigError("world.push", f"a push on {robot!r}", expected)
    if world.command_damp_ms < world.command_hold_ms:
        expected = f"at least world.command_hold_ms = {world.command_hold_ms}"
        raise ConfigError("world.command_damp_ms", str(world.command_damp_ms), expected)
    terrain = TERRAINS[world.terrain]
    height = getattr(world, terrain.height_key)
    if height < terrain.least_height:
        expected = f"at least {terrain.least_height:g} m for terrain {terrain.name!r}"
        raise ConfigError(f"world.{terrain.height_key}", f"{height:g}", expected)


def _check_models(config: Config) -> None:
    """Friction needs inertia."""
    motors = config.motors
    friction = max(motors.friction, motors.viscous_friction)
    if friction > 0.0 and not motors.rotor_inertia:
        got, expected = f"false with joint friction of {friction:g}", "true, or no joint friction"
        cause = "friction of light joints turns their rates around at every tick"
        raise ConfigError("motors.rotor_inertia", got, expected, cause)


def _check_planner(planner: PlannerConfig, world: WorldConfig) -> None:
    """The kind is installed; plans reach from one to the next; a peer is waited for."""
    kind = find_kind(planner.kind)
    read_options(kind, planner.options)
    if planner.applied > planner.N:
        expected = f"at most planner.N = {planner.N}"
        raise ConfigError("planner.applied", str(planner.applied), expected)
    if not kind.publishes:
        return
    if -1.0 < planner.damping < 0.0:
        raise ConfigError("planner.damping", f"{planner.damping:g}", "-1, or 0 … 0.95")
    if planner.cost == "team" and kind.needs_peers and planner.output_bounds != "none":
        got = f"{planner.output_bounds!r} with planner.cost 'team'"
        cause = "each agent would plan with bounds that its peers do not know"
        raise ConfigError("planner.output_bounds", got, "'none', or planner.cost = 'own'", cause)
    latency = max(1, planner.latency_ms) if kind.central else planner.latency_ms
    longest = SAMPLE_MS * (planner.N - planner.applied)
    if latency > longest:
        expected = f"at most {SAMPLE_MS}·(planner.N − planner.applied) = {longest} ms"
        cause = "a plan would have run out before the next one takes effect"
        raise ConfigError("planner.latency_ms", str(planner.latency_ms), expected, cause)
    least = planner.peer_timeout + _ANSWER
    if world.mode == "lockstep" and world.command_timeout < least:
        expected = f"at least planner.peer_timeout + {_ANSWER:g} s = {least:g} s"
        cause = "else robots that wait for a frozen peer's plan count as frozen too"
        raise ConfigError("world.command_timeout", f"{world.command_timeout:g}", expected, cause)


def _check_plants(config: Config) -> None:
    """What plants of a robot each cannot do: wait, be yoked in simulation, or know all truth."""
    team, each = config.team, "team.plant_per_robot"
    if team.plant == BRIDGED and not team.plant_per_robot:
        cause = "every robot has a bridge of its own"
        raise ConfigError(each, f"false with plant {BRIDGED!r}", "true", cause)
    if team.plant_per_robot and config.world.mode != "realtime":
        cause = "plants of one robot go by the clock and wait for nobody"
        expected = f"'realtime', or {each} = false"
        raise ConfigError("world.mode", f"'lockstep' with {each} = true", expected, cause)
    if team.plant_per_robot and config.estimator.kind == "truth":
        cause = "the plant of one robot does not know where all are"
        expected = f"'kalman', or {each} = false"
        raise ConfigError("estimator.kind", f"'truth' with {each} = true", expected, cause)
    simulated = team.plant == SIMULATED and team.plant_per_robot
    if simulated and team.robots > 1 and team.yokes != "none":
        got = f"true with simulated robots and {team.yokes!r} yokes"
        expected = f"team.yokes = 'none', or {each} = false"
        cause = "robots that are simulated in worlds of their own cannot pull at each other"
        raise ConfigError(each, got, expected, cause)


def _check_agent_command(config: Config) -> None:
    """A program of one's own has a command line, and nobody else plans for its robots."""
    line, kind = config.team.agent_command, config.planner.kind
    if line:
        parse_line(line)
    if line and kind != NO_PLANNER:
        got = f"{kind!r} with team.agent_command {line!r}"
        cause = "a program of one's own takes the place of agents and planners"
        raise ConfigError("planner.kind", got, repr(NO_PLANNER), cause)


def _check_identification(config: Config) -> None:
    ident = config.identification
    for key in _RANGES:
        first, last = getattr(ident, key)
        if first > last:
            raise ConfigError(f"identification.{key}", f"[{first}, {last}]", "[least, greatest]")
    if ident.response and ident.predictor != "periodic":
        got, expected = f"{ident.response!r} with {ident.predictor!r}", "predictor 'periodic'"
        cause = "no other is made of responses to single forces"
        raise ConfigError("identification.response", got, expected, cause)
