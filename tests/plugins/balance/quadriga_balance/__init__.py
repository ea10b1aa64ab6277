"""What quadriga asks about this planner; only who plans with it imports the planner itself."""

from quadriga.shared.planner_kinds import PlannerKind

KIND = PlannerKind(
    name="balance",
    title="forces in proportion to errors of speed, height and tilt",
    build="quadriga_balance.planner:Balance",
    needs_predictor=False,
    options={"speed": 20.0, "height": 150.0, "tilt": 60.0},
)
