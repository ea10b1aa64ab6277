"""The figures of a predictor's gates and their limits; stored in the predictor's file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from quadriga.agents.predictor.peers_figures import PeersFigures
from quadriga.shared.errors import PredictorError
from quadriga.shared.planner_kinds import find_kind


@dataclass(frozen=True, slots=True)
class GateReport:
    """Figures of a predictor and the limits they were compared with.

    Attributes:
        windows: held-out windows predicted.
        rmse: held-out error per output over the horizon, all robots [m, m/s, rad, rad/s].
        rmse_persistence: the same for holding the last measured output.
        error: scaled error of all outputs together over that of persistence; must be < 1.
        gain_times: times after the step of force at which the height response is compared [s].
        gains: predicted over physical height response, per robot and time, of the worst phase.
        gain_limits: every gain must lie between these.
        radius: spectral radius of the iteration of the agents' plans, the worst of all stance
            patterns and phases.
        radius_limit: must be below this.
        cost: that the agents minimise: "own", then the plans are best responses; "team".
        Q, R: planner weights that the radius was computed for.
        cost_probes: tell the QPs that the radius was computed for, whatever their cost is made of;
            () in a file of an earlier version, whose cost had no other weights than Q and R.
        condition: number of the regression, penalty included; None if it is not known.
        coupling: norm of the scaled G_ij, the largest of all phases, per robot i and j.
        size: of G, bytes.
        peers: what it says of the effect of peers' forces, against held-out data; None of a single
            robot, and in a file of an earlier version.
    """

    windows: int
    rmse: dict[str, float]
    rmse_persistence: dict[str, float]
    error: float
    gain_times: tuple[float, ...]
    gains: tuple[tuple[float, ...], ...]
    gain_limits: tuple[float, ...]
    radius: float
    radius_limit: float
    Q: tuple[float, ...]
    R: tuple[float, ...]
    condition: float | None = None
    coupling: tuple[tuple[float, ...], ...] = ()
    size: int = 0
    cost_probes: tuple[float, ...] = ()
    cost: str = "own"
    peers: PeersFigures | None = None

    @property
    def iteration(self) -> str:
        """What is iterated, in words."""
        return "best-response" if self.cost == "own" else "cooperative"

    def to_dict(self) -> dict[str, Any]:
        """A dictionary that can be written as JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> GateReport:
        """The inverse of `to_dict`, also after JSON has made lists of tuples.

        Raises:
            TypeError: fields are missing or unknown.
        """
        frozen: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in body.items()
        }
        for table in ("gains", "coupling"):
            frozen[table] = tuple(tuple(row) for row in frozen.get(table, ()))
        if frozen.get("peers") is not None:
            frozen["peers"] = PeersFigures.from_dict(frozen["peers"])
        return cls(**frozen)

    def check(self, kind: str = "distributed") -> None:
        """Refuse the predictor if a figure is beyond its limit.

        Args:
            kind: of planner that will use it; the radius and the effect of peers matter only if
                its agents respond to each other's plans.

        Raises:
            PredictorError: a figure is beyond its limit; the message names both.
        """
        if not self.error < 1.0:
            raise PredictorError(
                "predictor: held-out error",
                f"{self.error:.3f} of persistence",
                "below 1",
                "too little data, or a plant that the data do not show; collect more",
            )
        low, high = self.gain_limits
        for robot, row in enumerate(self.gains, start=1):
            for time, gain in zip(self.gain_times, row, strict=True):
                if not low <= gain <= high:
                    raise PredictorError(
                        f"predictor: height gain of r{robot} at {time:g} s",
                        f"{gain:.2f}",
                        f"{low:g} … {high:g} of the physical response",
                        "forces in the data that follow the outputs (feedback bias), "
                        "or a controller stiffer than the interface assumes",
                    )
        if not find_kind(kind).needs_peers:
            return
        if not self.radius < self.radius_limit:
            raise PredictorError(
                f"predictor: radius of the {self.iteration} map",
                f"{self.radius:.3f}",
                f"below {self.radius_limit:g}",
                "the agents' plans would diverge; "
                + (
                    "damp them by planner.damping, plan with planner.cost = 'team', or, of a ridge "
                    "fit, raise identification.block_weight"
                    if self.cost == "own"
                    else "leave planner.damping at 0, which chooses it"
                ),
            )
        if self.peers is not None:
            self.peers.check()
