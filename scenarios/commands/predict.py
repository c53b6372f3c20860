"""`rx90 predict`."""

import argparse

from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from ident.estimation.estimators import ESTIMATORS

    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file, with error sources")
    known = ", ".join(ESTIMATORS)
    add("--method", metavar="M", choices=ESTIMATORS, help=f"estimator: {known} (default the scenario's)")
    add("--option", action="append", default=[], metavar="KEY=VALUE", help="an option of the method; repeatable")
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Predict, report."""
    from threadpoolctl import threadpool_limits

    from scenarios.experiments.scenario import load_scenario, with_method
    from scenarios.prediction.budget import predicted_budget

    scenario = with_method(load_scenario(options.scenario), options.method, options.option)
    # threads of a BLAS do not speed up small matrices, and sometimes block
    with under_way(options, "predicting"), threadpool_limits(1):
        budget = predicted_budget(scenario)
    show(budget.report(budget.title), options)
    return Status.PASSED
