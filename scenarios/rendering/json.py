"""A report as one JSON object."""

from scenarios.rendering import Page
from scenarios.rendering.content import Report
from scenarios.rendering.result import to_json


def render(report: Report, page: Page) -> str:
    """Serialise the document; a number that is not finite is an error, as JSON has none."""
    return to_json(report.document) + "\n"
