"""A report as one JSON object."""

from scenarios.reports.content import Report
from scenarios.reports.renderers import Page
from scenarios.support.result_model import to_json


def render(report: Report, page: Page) -> str:
    """Serialise the document; a number that is not finite is an error, as JSON has none."""
    return to_json(report.document) + "\n"
