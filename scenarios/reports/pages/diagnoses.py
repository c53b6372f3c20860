"""What is said of logs and of an estimate: everything that was looked at, what is excluded, what cannot be told."""

from ident.diagnosis.diagnosis import Diagnosed
from scenarios.reports.content import Heading, Part
from scenarios.reports.diagnoses import every_line, horizon_paragraphs


def diagnosis_parts(found: Diagnosed) -> list[Part]:
    """A table of all diagnoses and what follows from them, none where nothing was looked at."""
    parts: list[Part] = [every_line(found.diagnoses)] if found.diagnoses else []
    parts += horizon_paragraphs(found, every=True)
    return [Heading("Diagnoses"), *parts] if parts else []
