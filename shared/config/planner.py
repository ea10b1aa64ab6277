"""Section of the planner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quadriga.shared.config.key import key
from quadriga.shared.planner_kinds import BUILT_IN, find_kind, read_options


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """The data-driven predictive planner."""

    preset: str = key(
        "usual",
        "-",
        "usual: plans every 40 ms, as in the paper, with other weights; fast: every 10 ms, for a "
        "network that delivers messages in less time, with weights of its own; paper: as the paper "
        "writes it, with its Q and R: replaces the defaults below",
        choices=("usual", "fast", "paper"),
    )
    kind: str = key(
        "distributed",
        "-",
        "; ".join(f"{kind.name}: {kind.title}" for kind in BUILT_IN.values()),
        choices=tuple(BUILT_IN),
        more="the name of a plug-in's",
    )
    options: str = key(
        "",
        "-",
        "numbers that a plug-in's planner lets be set: name=number pairs, separated by spaces",
    )
    cost: str = key(
        "own",
        "-",
        "distributed: what each agent minimises over its own forces. own: its own cost (eq. 12); "
        "team: that of the whole team, with peers' windows and plans brought forward and the new "
        "plan mixed with its last one: plans approach a central planner's whatever the coupling",
        choices=("own", "team"),
    )
    compensation: bool = key(
        True, "-", "distributed: bring peers' windows and plans forward by their age"
    )
    damping: float = key(
        -1.0,
        "1",
        "share of an agent's own last plan that its new one keeps; 0: none; -1: none with up to "
        "three robots (two with another preset than usual), else (n - 2)/(n + 2) with n. With the "
        "cost 'team' both are the share with which the plans converge fastest",
        low=-1.0,
        high=0.95,
    )
    exchanges: int = key(
        0, "-", "distributed: best responses to the peers' plans of the same step", low=0, high=8
    )
    latency_ms: int = key(
        8,
        "ms",
        "a plan made from data at t takes effect at t + this, at most 10·(N − applied)",
        low=0,
        high=100,
    )
    lambda_g: float = key(1e5, "1", "deepc: weight of ‖g‖²", low=1e-9, high=1e12)
    lambda_sigma: float = key(1e5, "1", "deepc: weight of ‖σ‖²", low=1e-9, high=1e15)
    interface: str = key(
        "feedforward",
        "-",
        "feedforward: force deviations become accelerations of the pre-stabilised trunk; "
        "force: planned forces and speeds are tracked by the whole-body QP (the paper)",
        choices=("feedforward", "force"),
    )
    tracked: str = key(
        "speeds",
        "-",
        "interface force: what of a plan's outputs the whole-body QP tracks. speeds: vx and vy; "
        "outputs: all of them (the paper)",
        choices=("speeds", "outputs"),
    )
    N: int = key(25, "samples", "control horizon", low=4, high=100)
    T_ini: int = key(10, "samples", "estimation horizon", low=2, high=50)
    applied: int = key(4, "samples", "samples applied before the next plan", low=1, high=20)
    Q: tuple[float, ...] = key(
        (1e6, 1e5, 1e5, 2e5, 2e5, 2e3), "-", "weights of z, vx, vy, roll, pitch, wz", low=0.0
    )
    R: tuple[float, ...] = key((0.2, 0.2, 0.05), "-", "weights of fx, fy, fz", low=1e-9)
    mu: float = key(0.6, "1", "friction coefficient of the planned forces", low=0.05, high=2.0)
    force_min: float = key(0.0, "N", "least planned normal force", low=0.0, high=50.0)
    deviation_max: tuple[float, ...] = key(
        (20.0, 20.0, 60.0), "N", "largest planned deviation from the nominal force", low=0.0
    )
    output_bounds: str = key(
        "none", "-", "whether planned outputs are bounded by output_max", choices=("none", "hard")
    )
    output_max: tuple[float, ...] = key(
        (0.03, 0.4, 0.3, 0.15, 0.15, 0.8),
        "m, m/s, m/s, rad, rad, rad/s",
        "largest planned deviation of z, vx, vy, roll, pitch, wz from what is commanded",
        low=1e-6,
    )
    trust_range: tuple[float, ...] = key(
        (0.06, 0.5, 0.25, 2.0),
        "m, m/s, rad, rad/s",
        "the plan fades out as the state leaves this range of the data",
        low=1e-6,
    )
    solver: str = key(
        "daqp",
        "-",
        "solver of the QP; daqp: the closed form, Newton's method at limits of forces, else DAQP",
        choices=("daqp", "osqp"),
    )
    max_peer_age: int = key(
        3, "planning steps", "a peer's plan older than this is no longer shifted", low=1, high=25
    )
    hold_steps: int = key(
        5,
        "planning steps",
        "a silent peer counts as planning nothing this long, then stop",
        low=0,
        high=250,
    )
    peer_timeout: float = key(
        5.0, "s wall", "lockstep: longest wait for a peer's plan", low=0.01, high=10.0
    )

    @property
    def option_values(self) -> Mapping[str, float]:
        """What `options` sets, and the defaults of its kind for the rest, in the kind's order."""
        return read_options(find_kind(self.kind), self.options)
