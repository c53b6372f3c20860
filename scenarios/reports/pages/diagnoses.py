"""What is said of logs and of an estimate: everything that was looked at, what is excluded, what cannot be told."""

from ident.diagnosis.diagnosis import Diagnosed
from scenarios.reports.check import every_line
from scenarios.reports.content import Heading, Paragraph, Part


def diagnosis_parts(found: Diagnosed) -> list[Part]:
    """A table of all diagnoses and what follows from them, none where nothing was looked at."""
    if not found.diagnoses and not found.excluded and not found.untold:
        return []
    parts: list[Part] = [Heading("Diagnoses")]
    parts += [every_line(found)] if found.diagnoses else []
    if found.excluded:
        parts.append(Paragraph(f"Excluded: {'; '.join(each.sentence for each in found.excluded)}."))
    if found.untold:
        parts.append(Paragraph(f"Cannot be told: {'; '.join(found.untold)}."))
    return parts
