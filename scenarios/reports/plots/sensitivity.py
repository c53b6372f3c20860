"""The figure of an error budget: one panel per joint with a common axis and tolerances."""

import math

import numpy as np
from matplotlib.figure import Figure

from scenarios.experiments.budget import Budget, ranking
from scenarios.experiments.schema import Scenario


def chart(found: Budget, scenario: Scenario) -> Figure:
    """Draw one panel per joint, sources sorted by their mean share."""
    budgets, order = found.joints, ranking(found.joints)[::-1]
    figure = Figure(figsize=(2.2 + 2.3 * len(budgets), 1.2 + 0.27 * len(order)), layout="constrained")
    tolerance = scenario.table.tolerance
    refused = [str(joint) for joint, wanted in enumerate(tolerance.identifiable, 1) if not wanted]
    without = f"\nno gain is expected of joint {', '.join(refused)}" if refused else ""
    figure.suptitle(f"{scenario.name}: error of the gain from each source alone{without}", fontsize=11)
    axes = np.atleast_1d(figure.subplots(1, len(budgets), sharex=True, sharey=True))
    at = np.arange(len(order))
    for axis, budget in zip(axes, budgets, strict=True):
        rms = {cost.source: 100.0 * cost.rms.value for cost in budget.costs}
        axis.barh(at, [rms.get(source, 0.0) for source in order], color="C0", height=0.7)
        together, allowed = (
            100.0 * (math.nan if budget.together is None else budget.together),
            100.0 * tolerance.gain[budget.joint - 1],
        )
        axis.axvline(together, color="C1", linestyle="--", linewidth=1.0, label="all together")
        if allowed <= 3.0 * max(together, *rms.values()):
            axis.axvline(allowed, color="C3", linestyle=":", linewidth=1.2, label="tolerance")
        else:
            axis.plot([], [], color="C3", linestyle=":", label=f"tolerance: beyond, {allowed:.3g} %")
        axis.set_title(f"joint {budget.joint}", fontsize=10)
        axis.set_xlabel("rms error [%]")
        axis.legend(loc="lower right", fontsize=7, framealpha=1.0, edgecolor="none")
    axes[0].set_yticks(at, order)
    return figure
