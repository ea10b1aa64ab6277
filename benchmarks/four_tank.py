"""Our predictors and controllers beside those of two other packages, on the four-tank example.

Without noise every controller has the same best plan: what differs is rounding, and time. With the
published noise all are run in closed loop. Packages that are not installed are left out by name.

Run: python -m benchmarks.four_tank [--plans 50] [--steps 100] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.four_tank_peers import (
    HOW_TO_INSTALL,
    PEERS,
    NoAnswer,
    Peer,
    TankPlanner,
    is_installed,
)
from quadriga.agents.predictor.control import DataDrivenController, Deepc
from quadriga.agents.predictor.four_tank import FourTank, LinearPlant, four_tank
from quadriga.agents.predictor.plant import PlantPredictor, fit
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic

NOISE: Final = 0.002  # of the published example
_UNSEEN: Final = 7  # seed of the windows that plans begin with, and of noise

PlanOnce = Callable[[Array, Array], tuple[Array, Array]]


class OwnController:
    """Eq. 7 with the predictor of one fit."""

    def __init__(self, example: FourTank, kind: str = "pinv", ridge: float = 1e-6) -> None:
        self._example = example
        self.predictor: PlantPredictor = fit(
            example.data, kind, example.past, example.horizon, ridge=ridge
        )
        self._controller = DataDrivenController(self.predictor, example.weights)

    def plan(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """See `TankPlanner`."""
        references = self._example.reference, self._example.input_reference
        plan = self._controller.plan(past_u, past_y, *references)
        return plan.u, plan.y


class OwnDeepc:
    """Eq. 5."""

    def __init__(self, example: FourTank) -> None:
        self._example = example
        self._deepc = Deepc(example.data, example.past, example.horizon, example.weights)

    def plan(self, past_u: Array, past_y: Array) -> tuple[Array, Array]:
        """See `TankPlanner`."""
        references = self._example.reference, self._example.input_reference
        plan = self._deepc.plan(past_u, past_y, *references)
        return plan.u, plan.y


@dataclass(frozen=True)
class Agreement:
    """How far a package's answers are from ours without noise, and from the plant's.

    Attributes:
        name: of the package.
        unanswered: plans that its solver failed at, which are not compared.
        prediction: largest difference of its predicted outputs from ours for its inputs.
        truth: largest difference of our prediction from what the plant does.
        inputs: largest difference of planned inputs.
        closed_loop: largest difference of levels in a closed loop with its usual tolerance.
        set_up, set_up_own: s, until the first plan can be asked for.
        plan, plan_own: s, medians of as many plans, in turns.
    """

    name: str
    unanswered: int
    prediction: float
    truth: float
    inputs: float
    closed_loop: float
    set_up: float
    set_up_own: float
    plan: float
    plan_own: float


@dataclass(frozen=True)
class ClosedLoop:
    """A closed loop on data with noise, from the same state and with the same noise.

    Attributes:
        name: of the controller.
        cost: mean of ‖y − r‖²_Q + ‖u − r_u‖²_R over the steps.
        error: root mean square of the true levels from theirs over the last third.
    """

    name: str
    cost: float
    error: float


def windows(example: FourTank, count: int) -> list[tuple[Array, Array, Array]]:
    """Pasts that are in nobody's data, and the plant's state after each."""
    random = np.random.default_rng(_UNSEEN)
    plant, found = copy_of(example.plant), []
    for _ in range(count):
        u = random.uniform(-1.0, 1.0, (example.past, 2))
        y = plant.respond(u)
        found.append((u, y, plant.x))
    return found


def copy_of(plant: LinearPlant) -> LinearPlant:
    """The same plant in the same state, which goes its own way."""
    copy = LinearPlant(plant.A, plant.B, plant.C, plant.D)
    copy.x = plant.x
    return copy


def agreement(name: str, example: FourTank, plans: int, steps: int) -> Agreement:
    """Compare a package with ours on noise-free data: equal answers, and times side by side."""
    begun = monotonic()
    peer: Peer = PEERS[name](example)
    set_up, begun = monotonic() - begun, monotonic()
    own = OwnController(example)
    set_up_own = monotonic() - begun
    apart: dict[str, list[float]] = {"prediction": [], "truth": [], "inputs": []}
    times: list[tuple[float, float]] = []
    for past_u, past_y, state in windows(example, plans):
        try:
            u, y = peer.plan_tightly(past_u, past_y)
        except NoAnswer:
            continue
        predicted = own.predictor.predict(past_u, past_y, u)
        plant = copy_of(example.plant)
        plant.x = state
        apart["prediction"].append(largest(y - predicted))
        apart["truth"].append(largest(plant.respond(u) - predicted))
        apart["inputs"].append(largest(own.plan(past_u, past_y)[0] - u))
        times.append((timed(peer, past_u, past_y), timed(own, past_u, past_y)))
    loops = [drive(plan, example, steps) for plan in (peer.plan, own.plan)]
    plan, plan_own = np.median(times, axis=0)
    return Agreement(
        name,
        unanswered=plans - len(times),
        **{key: max(values) for key, values in apart.items()},
        closed_loop=largest(loops[0][1] - loops[1][1]),
        set_up=set_up,
        set_up_own=set_up_own,
        plan=plan,
        plan_own=plan_own,
    )


def largest(x: Array) -> float:
    """The largest entry, whatever its sign."""
    return float(np.abs(x).max())


def timed(planner: TankPlanner, past_u: Array, past_y: Array) -> float:
    """Seconds of one plan."""
    begun = monotonic()
    planner.plan(past_u, past_y)
    return monotonic() - begun


def drive(plan: PlanOnce, example: FourTank, steps: int, noise: float = 0.0) -> tuple[Array, Array]:
    """Apply the first input of every plan to the plant, whose levels are measured with noise.

    Returns:
        Inputs and true levels, shape (steps, 2) each.
    """
    random, plant, count = np.random.default_rng(_UNSEEN), copy_of(example.plant), example.past
    inputs, levels = list(example.data.u[0][-count:, 0]), []
    measured = list(example.data.y[0][-count:, 0])
    for _ in range(steps):
        u = plan(np.array(inputs[-count:]), np.array(measured[-count:]))[0][0]
        y = plant.respond(u)
        inputs.append(u)
        levels.append(y)
        measured.append(y + noise * random.uniform(-1.0, 1.0, 2))
    return np.array(inputs[count:]), np.array(levels)


def close_loop(name: str, planner: TankPlanner, example: FourTank, steps: int) -> ClosedLoop:
    """A closed loop with the published noise."""
    u, y = drive(planner.plan, example, steps, NOISE)
    Q, R = (float(np.asarray(w)) for w in (example.weights.Q, example.weights.R))
    error = ((y - example.reference) ** 2).sum(axis=1)
    effort = ((u - example.input_reference) ** 2).sum(axis=1)
    rest = error[-max(1, steps // 3) :]
    return ClosedLoop(name, float((Q * error + R * effort).mean()), float(np.sqrt(rest.mean())))


def closed_loops(names: Sequence[str], steps: int) -> list[ClosedLoop]:
    """Closed loops of ours and of all packages that are installed."""
    example = four_tank(noise=NOISE)
    planners: dict[str, Callable[[], TankPlanner]] = {
        "ours, pinv": partial(OwnController, example),
        "ours, ridge": partial(OwnController, example, "ridge", ridge=1e-4),
        "ours, deepc": partial(OwnDeepc, example),
    }
    planners |= {name: partial(PEERS[name], example, NOISE) for name in names}
    return [close_loop(name, build(), example, steps) for name, build in planners.items()]


def measure(plans: int, steps: int) -> dict[str, Any]:
    """All that is compared, with the packages that are missing and how to get them."""
    use_one_blas_thread()
    names = [name for name in PEERS if is_installed(name)]
    example = four_tank()
    return {
        "agreement": [asdict(agreement(name, example, plans, steps)) for name in names],
        "closed_loops": [asdict(loop) for loop in closed_loops(names, steps)],
        "missing": {name: HOW_TO_INSTALL[name] for name in PEERS if name not in names},
    }


def lines(result: Mapping[str, Any]) -> list[str]:
    """The page that is printed."""
    page = []
    for row in result["agreement"]:
        page += [
            f"{row['name']}, without noise",
            f"  prediction {row['prediction']:.1e} from ours, which is {row['truth']:.1e} from the "
            f"plant; planned inputs {row['inputs']:.1e} apart",
            f"  plans that its solver failed at, left out: {row['unanswered']}",
            f"  levels in closed loop, with its usual tolerance, {row['closed_loop']:.1e} apart",
            f"  set-up {1e3 * row['set_up']:.0f} ms, ours {1e3 * row['set_up_own']:.1f} ms: "
            f"{row['set_up'] / row['set_up_own']:.0f} ×",
            f"  plan {1e3 * row['plan']:.2f} ms, ours {1e3 * row['plan_own']:.3f} ms: "
            f"{row['plan'] / row['plan_own']:.0f} ×",
        ]
    page.append(f"closed loops with noise of {NOISE:g}")
    page += [
        f"  {loop['name']:24} cost {loop['cost']:.5f}  error at the end {loop['error']:.5f}"
        for loop in result["closed_loops"]
    ]
    page += [f"{name} is not installed: {how}" for name, how in result["missing"].items()]
    return page


def main() -> None:
    """Measure, print and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plans", type=int, default=50, help="plans that are compared and timed")
    parser.add_argument("--steps", type=int, default=100, help="of a closed loop")
    parser.add_argument("--out", type=Path, help="JSON file to write")
    given = parser.parse_args()
    result = measure(given.plans, given.steps)
    print("\n".join(lines(result)))
    if given.out:
        given.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
