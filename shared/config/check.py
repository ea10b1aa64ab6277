"""Contradictions between keys of a configuration, and rules that a range cannot say."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from quadriga.shared.agent_command import parse_line
from quadriga.shared.config.endpoints import check_port
from quadriga.shared.config.per_robot import carriers, friction_of_robots
from quadriga.shared.config.sections import BRIDGED, SIMULATED, Config
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.config.timing import PEER_TIMEOUT
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import NO_PLANNER, find_kind, read_options
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import SAMPLE_MS

_TEAM_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_EACH: Final = "team.plant_per_robot"
_ANSWER: Final = 1.0  # s wall, for a robot's step once it has waited for a peer in vain

Rule = tuple[bool, str, str, str, str]  # whether it is broken; key, got, expected and cause


def check(config: Config) -> None:
    """Rules that need more than one key, or more than a range.

    Raises:
        ConfigError: a rule is broken; the first one that is.
    """
    for rules in (_keys, _planner, _plants):
        for is_broken, *error in rules(config):
            if is_broken:
                raise ConfigError(*error)


def _keys(config: Config) -> Iterator[Rule]:
    team, world, motors, ident = config.team, config.world, config.motors, config.identification
    expected, cause = "1 to 64 letters, digits, . _ or -", "it is the first part of every key"
    yield not _TEAM_NAME.fullmatch(team.name), "team.name", repr(team.name), expected, cause
    check_port("bus.endpoint", config.bus.endpoint)
    for key in ("stance_ms", "stand_ms"):
        value = getattr(config.gait, key)
        expected = f"a multiple of {SAMPLE_MS} ms"
        yield value % SAMPLE_MS != 0, f"gait.{key}", str(value), expected, ""
    names = robot_names(team.robots)
    carriers(world.payload_on, names)
    friction_of_robots(world.friction_of, world.friction, names)
    for push in filter(None, world.push.split(",")):
        robot = push.partition(":")[0].strip()
        expected = f"all or one of {', '.join(names)}"
        yield robot not in ("all", *names), "world.push", f"a push on {robot!r}", expected, ""
    hold, damp = world.command_hold_ms, world.command_damp_ms
    expected = f"at least world.command_hold_ms = {hold}"
    yield damp < hold, "world.command_damp_ms", str(damp), expected, ""
    terrain = TERRAINS[world.terrain]
    height, least = getattr(world, terrain.height_key), terrain.least_height
    expected = f"at least {least:g} m for terrain {terrain.name!r}"
    yield height < least, f"world.{terrain.height_key}", f"{height:g}", expected, ""
    friction = max(motors.friction, motors.viscous_friction)
    got, expected = f"false with joint friction of {friction:g}", "true, or no joint friction"
    cause = "friction of light joints turns their rates around at every tick"
    yield friction > 0 and not motors.rotor_inertia, "motors.rotor_inertia", got, expected, cause
    for key in ("vx", "vy", "wz", "gain_range"):
        first, last = getattr(ident, key)
        got = f"[{first}, {last}]"
        yield first > last, f"identification.{key}", got, "[least, greatest]", ""
    is_broken = bool(ident.response) and ident.predictor != "periodic"
    got, expected = f"{ident.response!r} with {ident.predictor!r}", "predictor 'periodic'"
    cause = "no other is made of responses to single forces"
    yield is_broken, "identification.response", got, expected, cause


def _planner(config: Config) -> Iterator[Rule]:
    """The kind is installed; plans reach from one to the next; a peer is waited for."""
    planner, world, line = config.planner, config.world, config.team.agent_command
    kind = find_kind(planner.kind)
    read_options(kind, planner.options)
    if line:
        parse_line(line)
    got = f"{planner.kind!r} with team.agent_command {line!r}"
    cause = "a program of one's own takes the place of agents and planners"
    is_broken = bool(line) and planner.kind != NO_PLANNER
    yield is_broken, "planner.kind", got, repr(NO_PLANNER), cause
    expected = f"at most planner.N = {planner.N}"
    yield planner.applied > planner.N, "planner.applied", str(planner.applied), expected, ""
    if not kind.publishes:
        return
    is_broken = -1.0 < planner.damping < 0.0
    yield is_broken, "planner.damping", f"{planner.damping:g}", "-1, or 0 … 0.95", ""
    is_broken = planner.cost == "team" and kind.needs_peers and planner.output_bounds != "none"
    got = f"{planner.output_bounds!r} with planner.cost 'team'"
    cause = "each agent would plan with bounds that its peers do not know"
    yield is_broken, "planner.output_bounds", got, "'none', or planner.cost = 'own'", cause
    latency = max(1, planner.latency_ms) if kind.central else planner.latency_ms
    longest = SAMPLE_MS * (planner.N - planner.applied)
    expected = f"at most {SAMPLE_MS}·(planner.N − planner.applied) = {longest} ms"
    cause = "a plan would have run out before the next one takes effect"
    yield latency > longest, "planner.latency_ms", str(planner.latency_ms), expected, cause
    least = PEER_TIMEOUT + _ANSWER
    is_broken = world.mode == "lockstep" and world.command_timeout < least
    expected = f"at least {least:g} s"
    cause = "else robots that wait for a frozen peer's plan count as frozen too"
    yield is_broken, "world.command_timeout", f"{world.command_timeout:g}", expected, cause


def _plants(config: Config) -> Iterator[Rule]:
    """What plants of a robot each cannot do: wait, be yoked in simulation, or know all truth."""
    team, each = config.team, config.team.plant_per_robot
    is_broken = team.plant == BRIDGED and not each
    cause = "every robot has a bridge of its own"
    yield is_broken, _EACH, f"false with plant {BRIDGED!r}", "true", cause
    is_broken = each and config.world.mode != "realtime"
    expected = f"'realtime', or {_EACH} = false"
    cause = "plants of one robot go by the clock and wait for nobody"
    yield is_broken, "world.mode", f"'lockstep' with {_EACH} = true", expected, cause
    is_broken = each and config.estimator.kind == "truth"
    expected = f"'kalman', or {_EACH} = false"
    cause = "the plant of one robot does not know where all are"
    yield is_broken, "estimator.kind", f"'truth' with {_EACH} = true", expected, cause
    is_broken = each and team.plant == SIMULATED and team.robots > 1 and team.yokes != "none"
    got = f"true with simulated robots and {team.yokes!r} yokes"
    expected = f"team.yokes = 'none', or {_EACH} = false"
    cause = "robots that are simulated in worlds of their own cannot pull at each other"
    yield is_broken, _EACH, got, expected, cause
