"""Sections of the team and of how its processes run, reach each other and are recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from quadriga.shared.config.key import key
from quadriga.shared.robots.registry import ROBOTS

SIMULATED: Final = "mujoco"  # the kind of plant that is a simulated world
BRIDGED: Final = "robots"  # the kind that is robots of their own, each behind a bridge


@dataclass(frozen=True, slots=True)
class TeamConfig:
    """The robots of the team."""

    name: str = key("team", "-", "first part of every key; teams on one network need own names")
    robots: int = key(3, "1", "number of robots r1 … rn", low=1, high=10)
    robot: str = key(
        "a1",
        "-",
        "kind of all robots of the team",
        choices=tuple(ROBOTS),
        hint="all robots of a team are of one kind",
    )
    yokes: str = key(
        "complete", "-", "which pairs are yoked", choices=("complete", "chain", "ring", "none")
    )
    spacing: float = key(0.9, "m", "distance between neighbours at the start", low=0.6, high=3.0)
    alternate_phase: bool = key(True, "-", "every second robot trots half a gait period later")
    auto_resume: bool = key(
        False,
        "-",
        "robots that stand because an input was lost walk again once all have been whole for "
        "resume_after; false: only once the operator says so (quadriga resume)",
    )
    # More would outlast the operator's word, which is obeyed for 5 s.
    resume_after: float = key(
        1.0,
        "s",
        "how long all inputs of a robot that stands must have been whole before it walks again, by "
        "itself or on the operator's word",
        low=0.2,
        high=4.0,
    )
    plant: str = key(
        SIMULATED,
        "-",
        "what the robots are: mujoco; robots: real ones behind bridges; or a kind that an "
        "installed package adds",
    )
    plant_per_robot: bool = key(
        False,
        "-",
        "true: every robot has a plant of its own; false: a single process is the plant of all",
    )
    agent_command: str = key(
        "",
        "-",
        "command line of a program of one's own that is the agent of each robot, see "
        "docs/tutorials/own_controller.md; empty: the project's own agents",
    )

    @property
    def one_world(self) -> bool:
        """Whether the plant is one simulated world of all robots: it knows the truth of all."""
        return self.plant == SIMULATED and not self.plant_per_robot


@dataclass(frozen=True, slots=True)
class BusConfig:
    """How the processes reach each other over Zenoh."""

    mode: str = key(
        "peer",
        "-",
        "peer: processes connect directly; client: all through a router",
        choices=("peer", "client"),
    )
    endpoint: str = key(
        "tcp/127.0.0.1:7447",
        "-",
        "where the sim server, or plant_r1, listens (peer) or the router is (client); off the "
        "loopback tls/HOST:PORT",
    )
    listen: str = key(
        "tcp/127.0.0.1:0", "-", "peer mode: where every other process listens; port 0: any free one"
    )
    certificates: str = key(
        "certs",
        "-",
        "endpoints tls/HOST:PORT: folder with a folder for each process, see docs/security.md",
    )
    plaintext: bool = key(
        False,
        "-",
        "permit endpoints off the loopback without certificates: whoever reaches them commands the "
        "robots",
    )
    barrier_timeout: float = key(
        60.0, "s", "how long to wait for all processes before giving up", low=0.1, high=3600.0
    )
    clock_timeout: float = key(
        0.5,
        "s",
        "realtime, plants of their own: how old the newest message of a plant may be; one that is "
        "silent or behind for longer is given up and the walk ends",
        low=0.3,
        high=10.0,
    )


@dataclass(frozen=True, slots=True)
class RecorderConfig:
    """The recording of all traffic."""

    enabled: bool = key(True, "-", "the team waits for the recorder before it walks")
    chunk_kib: int = key(
        256, "KiB", "largest MCAP chunk; smaller ones are closed every 50 ms", low=16, high=65536
    )


@dataclass(frozen=True, slots=True)
class RuntimeConfig:
    """How the operating system runs the processes."""

    priority: str = key(
        "realtime",
        "-",
        "realtime: agents, planner and plants, in lockstep also the recorder, take precedence over "
        "ordinary processes (SCHED_RR) if the user may do so; in realtime the recorder has nice "
        "-15, and takes the same precedence once it gets too little; ordinary: as any other; "
        "QUADRIGA_PRIORITY of the environment overrides it",
        choices=("realtime", "ordinary"),
    )
    check_cpu: bool = key(
        True,
        "-",
        "realtime: refuse to begin on a computer that the agents' ticks alone would keep busier "
        "than it can be, as measured before",
    )
