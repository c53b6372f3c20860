"""Report of `rx90 payload`: accuracy with the scenario's payload and with the best one, and the best of each shape."""

from scenarios.design.payload_design import DesignedJoint, DesignedPayload, PayloadDesign
from scenarios.prediction.deviations import RESIDUAL
from scenarios.rendering.content import NONE, Cell, Mood, Paragraph, Part, Report, Table, column, percent, table


def payload_report(design: PayloadDesign) -> Report:
    """Return the report: conclusion, accuracy by joint before and after, shapes, limits."""
    parts: list[Part] = [*_conclusion(design), _joints(design), _shapes(design)]
    parts += [
        Paragraph(f"The best {each.shape} {each.refusal}; it must not be mounted.", Mood.DOUBTFUL)
        for each in design.candidates
        if each.refusal
    ]
    limit = "" if design.rated_load is None else f"rated load {design.rated_load:g} kg, "
    parts.append(
        Paragraph(
            f"Deviations for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque; 'payload as made' "
            f"includes the tolerances of dimensions and scale. Limits: {limit}torque of the drives, distance to floor "
            f"and arm. Frame: {design.flange or 'axis of the last joint, as the robot has no flange'}."
        )
    )
    if design.rated_load is None:
        parts.append(
            Paragraph(
                "WARNING: no rated load is specified, so the payload may be heavier than the arm may carry: look the "
                "load up in the data sheet and state it as rated_load in robot.toml.",
                Mood.DOUBTFUL,
            )
        )
    return Report(f"Payload for scenario {design.scenario}", tuple(parts), design.model_dump(mode="json"))


def _conclusion(design: PayloadDesign) -> list[Part]:
    parts: list[Part] = []
    own, new = design.before.worst, design.after.worst
    if design.own_is_better:
        words = f"The scenario's own payload already identifies the worst joint better: {percent(own, '.2f')} % "
        parts.append(Paragraph(f"{words}against {percent(new, '.2f')} %; keep it.", Mood.DOUBTFUL, strong=True))
    missing = [str(each.joint) for each in design.after.joints if not each.shown]
    if missing:
        words, mood = f"No payload within the limits identifies joint {', '.join(missing)}.", Mood.BAD
    else:
        worst, mood = percent(design.after.worst_as_made, ".2f"), Mood.GOOD
        shape = design.candidates[0].shape
        words = f"The {shape} identifies every joint; the worst gain's standard deviation is {worst} %."
    return [*parts, Paragraph(words, mood, strong=True)]


def _joints(design: PayloadDesign) -> Table:
    def verdict(before: DesignedJoint, after: DesignedJoint) -> Cell:
        if after.shown:
            return Cell("as before" if before.shown else "identified now", Mood.GOOD)
        return Cell("lost" if before.shown else "refused", Mood.BAD)

    return table(
        list(zip(design.before.joints, design.after.joints, strict=True)),
        column("Joint", lambda row: row[0].joint),
        column("Payload\nbefore [N m rms]", lambda row: f"{row[0].payload_torque_rms:.3g}"),
        column("Deviation\nbefore [%]", lambda row: percent(row[0].std, ".2f")),
        column("Payload\nafter [N m rms]", lambda row: f"{row[1].payload_torque_rms:.3g}"),
        column("Deviation\nafter [%]", lambda row: percent(row[1].std, ".2f")),
        column("Payload\nas made [%]", lambda row: percent(row[1].payload_std, ".2f")),
        column("Gain", lambda row: verdict(*row), words=True),
    )


def _shapes(design: PayloadDesign) -> Table:
    rows: list[tuple[Cell, str, DesignedPayload]] = [(Cell("its own"), NONE, design.before)]
    for each in design.candidates:
        sizes = ", ".join(f"{name} {size:g}" for name, size in each.dimensions_mm.items())
        shape = Cell(each.shape, Mood.BAD if each.refusal else Mood.PLAIN)
        rows.append((shape, f"{sizes}, turned {each.turned_deg}\u00b0", each))
    return table(
        rows,
        column("Shape", lambda row: row[0], words=True),
        column("Dimensions [mm]", lambda row: row[1], words=True),
        column("Mass [kg]", lambda row: f"{row[2].payload['mass']:.3f}"),
        column("Off axis [mm]", lambda row: NONE if row[2].off_axis_mm is None else f"{row[2].off_axis_mm:.1f}"),
        column("Worst joint [%]", lambda row: percent(row[2].worst_as_made, ".2f")),
    )
