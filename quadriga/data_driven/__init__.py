"""Data-driven prediction and control of any plant: what the robots use, for any inputs and outputs.

    data = Data(u=[u], y=[y])                       # inputs (T, m) and outputs (T, p) of episodes
    predictor = fit(data, kind="spc", past=4, horizon=30)
    y = predictor.predict(past_u, past_y, future_u) # (N, p)
    controller = DataDrivenController(predictor, PlanWeights(Q=3.0, R=1e-4))
    u = controller.plan(past_u, past_y, reference).u[0]

Equations have the numbers that they have everywhere in this project: the Hankel matrix is eq. 2,
DeePC eq. 5, the matrix G of subspace predictive control eq. 6, the plan with it eq. 7. A plant may
be of several agents, with inputs and outputs of their own: then every signal has an axis more,
(T, n, m). Every mistake is a `quadriga.shared.errors.PredictorError` that names it.
"""

from quadriga.data_driven.controller import DataDrivenController
from quadriga.data_driven.deepc import Deepc
from quadriga.data_driven.excitation import hankel, is_persistently_exciting
from quadriga.data_driven.fits import KINDS, fit
from quadriga.data_driven.fitted_predictor import FittedPredictor
from quadriga.data_driven.four_tank_process import FourTank, LinearPlant, four_tank
from quadriga.data_driven.judgement import Judgement, judge
from quadriga.data_driven.plan import DataDrivenPlan, PlanBounds, PlanWeights
from quadriga.data_driven.store import load, save
from quadriga.data_driven.trajectories import Data

__all__ = [
    "KINDS",
    "Data",
    "DataDrivenController",
    "DataDrivenPlan",
    "Deepc",
    "FittedPredictor",
    "FourTank",
    "Judgement",
    "LinearPlant",
    "PlanBounds",
    "PlanWeights",
    "fit",
    "four_tank",
    "hankel",
    "is_persistently_exciting",
    "judge",
    "load",
    "save",
]
