"""Section of data collection and the predictor."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.key import key


@dataclass(frozen=True, slots=True)
class IdentificationConfig:
    """Data collection and the predictor's fit and gates."""

    preset: str = key(
        "usual",
        "-",
        "usual; paper: the pseudo-inverse, whatever its best-response radius: replaces the "
        "defaults below",
        choices=("usual", "paper"),
    )
    seconds: float = key(
        0.0,
        "s",
        "world time collected for training; 0: chosen by the size of the team",
        low=0.0,
        high=3600.0,
    )
    disturbed: float = key(
        0.25,
        "1",
        "share of this time that is collected in addition without force noise, on boxes and under "
        "pushes",
        low=0.0,
        high=10.0,
    )
    held_out: float = key(8.0, "s", "world time held out of the fit", low=2.0, high=600.0)
    episode: float = key(10.5, "s", "length of one episode", low=3.0, high=600.0)
    noise: tuple[float, ...] = key(
        (3.0, 3.0, 5.0), "N", "force noise (std) fx, fy, fz of each foot for itself", low=0.0
    )
    wrench_noise: tuple[float, ...] = key(
        (16.0, 16.0, 8.0, 14.0, 8.0),
        "N",
        "force noise of a robot's feet together, of either sign, at each stance foot: along x, y, "
        "z, vertical couple, horizontal couple",
        low=0.0,
    )
    noise_hold_ms: int = key(20, "ms", "how long one draw of noise is held", low=10, high=500)
    vx: tuple[float, ...] = key((-0.2, 0.7), "m/s", "range of random forward speeds", low=-2.0)
    vy: tuple[float, ...] = key((-0.2, 0.2), "m/s", "range of random sideways speeds", low=-2.0)
    wz: tuple[float, ...] = key((-0.3, 0.3), "rad/s", "range of random yaw rates", low=-2.0)
    hold: float = key(1.5, "s", "how long a random speed is held", low=0.1, high=60.0)
    seed: int = key(1000, "-", "seed of the collection", low=0, high=2**31)
    predictor: str = key(
        "periodic",
        "-",
        "the fit of G; pinv: the paper's; ridge: regularised, block-weighted; periodic: a function "
        "of the gait's phase, in which no force acts on outputs before it, with peers' forces by "
        "their net wrench",
        choices=("ridge", "pinv", "periodic"),
    )
    response: str = key(
        "",
        "-",
        "predictor 'periodic': the file responses.npz of a probe, whose measured responses stand "
        "for those fitted to data: only in simulation, for comparison; {robots} in it is how many "
        "there are",
    )
    neighbours: str = key(
        "all",
        "-",
        "yoked: robots that are not yoked to each other are taken to be uncoupled",
        choices=("all", "yoked"),
    )
    ridge: float = key(1e-3, "1", "ridge per data column", low=1e-12, high=1e3)
    block_weight: float = key(
        160.0, "1", "extra penalty weight w (as w²) on the columns of peers", low=1.0, high=1e4
    )
    order_per_robot: int = key(
        12,
        "states",
        "assumed system order n = this · robots, for T ≥ (m+1)(T_ini+N+n)−1",
        low=1,
        high=100,
    )
    max_radius: float = key(
        1.0, "1", "gate: spectral radius of the best-response map", low=0.01, high=10.0
    )
    max_peers_harm: float = key(
        0.02,
        "1",
        "gate: share by which the predicted effect of peers may raise the squared error of an "
        "output on held-out data; beyond its 95 % interval it is refused",
        low=0.0,
        high=1000.0,
    )
    gain_range: tuple[float, ...] = key(
        (0.3, 2.0), "1", "gate: predicted over physical height response", low=-10.0
    )
