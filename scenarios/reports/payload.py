"""Report of `rx90 payload`: accuracy with the scenario's payload and with designed ones, drawing of the best."""

import shlex
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import scenarios.design.results as results
from ident.payload.files import payload_to_table
from ident.support.arrays import Array
from ident.support.naming import one_line
from scenarios.design.payload_design import Mounted, PayloadDesign
from scenarios.design.payload_folder import SCENARIO
from scenarios.design.weights import MM
from scenarios.prediction.deviations import RESIDUAL
from scenarios.reports.content import Cell, Figure, Line, Mood, Paragraph, Part, Report, Table, column, percent, table
from scenarios.reports.payload_drawing import draw_weight

DRAWING = "payload-drawing"


def payload_report(design: PayloadDesign, folder: Path | None) -> Report:
    """Return the report: accuracy by joint before and after, the shapes, the drawing, and the folder of its files."""
    best = design.best
    parts: list[Part] = [*_conclusion(design), _joints(design), *_why(design), _shapes(design)]
    parts += [
        Paragraph(f"The best {each.weight.shape} {each.refusal}; it must not be mounted.", Mood.DOUBTFUL)
        for each in design.candidates
        if each.refusal
    ]
    flange, most = design.carrying.flange, design.carrying.most
    where = flange.name or "last joint's axis, as the robot has no flange"
    limit = f"rated load {most:g} kg, " if np.isfinite(most) else ""
    parts.append(
        Paragraph(
            f"Deviations for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque; 'payload as made' "
            f"includes the tolerances of dimensions and scale. Limits: {limit}torque "
            f"of the drives, distance to floor and arm. Frame: {where}."
        )
    )
    if not np.isfinite(most):
        parts.append(
            Paragraph(
                "WARNING: no rated load is specified, so the payload may be heavier than the arm may carry: look the "
                "load up in the data sheet and state it as rated_load in robot.toml.",
                Mood.DOUBTFUL,
            )
        )
    if folder is not None:
        parts += [
            Paragraph(f"Payload file, scenario and drawing in {one_line(folder)}. Next:"),
            Line(f"rx90 run {shlex.quote(str(folder / SCENARIO))}"),
        ]
    caption = f"{best.weight.shape.capitalize()} of {best.payload.mass:.3f} kg"
    draw = partial(draw_weight, best.weight, flange=flange.name)
    parts.append(Figure(name=DRAWING, caption=caption, draw=draw, endings=("png", "svg")))
    return Report(
        f"Payload for scenario {design.scenario.name}",
        tuple(parts),
        payload_design_result(design).model_dump(mode="json"),
    )


def payload_design_result(design: PayloadDesign) -> results.PayloadDesign:
    """Return the result of a design for JSON."""
    carrying = design.carrying
    return results.PayloadDesign(
        scenario=design.scenario.name,
        residual=RESIDUAL,
        rated_load=carrying.most if np.isfinite(carrying.most) else None,
        own_is_better=design.worst(design.before.deviations) <= design.worst(design.after.deviations),
        flange=carrying.flange.name or None,
        before=results.DesignedPayload.model_validate(_told(design, design.before)),
        after=results.DesignedPayload.model_validate(_told(design, design.after)),
        candidates=[
            results.DesignedWeight(
                shape=each.weight.shape,
                dimensions_mm=each.weight.named,
                turned_deg=90 * each.weight.quarter,
                density=each.weight.density,
                refusal=each.refusal or None,
                **_told(design, each),
            )
            for each in design.candidates
        ],
    )


def _told(design: PayloadDesign, found: Mounted) -> dict[str, Any]:
    """Return the values of a `DesignedPayload`."""
    shown, noise = design.shows(found.deviations), found.deviations.noise
    joints = [
        results.DesignedJoint(
            joint=j + 1,
            wanted=j in design.joints,
            payload_torque_rms=float(torque),
            std=results.finite(noise[j]),
            payload_std=results.finite(found.deviations.payload[j]),
            shown=bool(shown[j]),
        )
        for j, torque in enumerate(found.torque)
    ]
    return {"payload": payload_to_table(found.payload), "joints": joints}


def _joints(design: PayloadDesign) -> Table:
    before, after = design.before, design.after
    shown = list(zip(design.shows(before.deviations).tolist(), design.shows(after.deviations).tolist(), strict=True))
    return table(
        range(len(shown)),
        column("Joint", lambda j: j + 1),
        column("Payload\nbefore [N m rms]", lambda j: f"{before.torque[j]:.3g}"),
        column("Deviation\nbefore [%]", lambda j: percent(before.deviations.noise[j], ".2f")),
        column("Payload\nafter [N m rms]", lambda j: f"{after.torque[j]:.3g}"),
        column("Deviation\nafter [%]", lambda j: percent(after.deviations.noise[j], ".2f")),
        column("Payload\nas made [%]", lambda j: percent(after.deviations.payload[j], ".2f")),
        column("Gain", lambda j: _verdict(*shown[j]), words=True),
    )


def _verdict(before: bool, after: bool) -> Cell:
    if after:
        return Cell("as before" if before else "identified now", Mood.GOOD)
    return Cell("lost" if before else "refused", Mood.BAD)


def _why(design: PayloadDesign) -> list[Paragraph]:
    """Return why the scenario's payload does not identify some joint, and the torque of the new one on it."""
    before, after = design.before, design.after
    said: list[Paragraph] = []
    for j in np.flatnonzero(~design.shows(before.deviations)):
        text = (
            f"Joint {j + 1}: the scenario's payload contributes {before.torque[j]:.2g} of "
            f"{design.all_torque[j]:.3g} N m rms"
        )
        if j == len(before.torque) - 1 and before.payload.com is not None:
            off, now = (_beside(design, np.array(each.com)) for each in (before.payload, after.payload))
            text += f" (centre of mass {1e3 * off:.1f} mm off the flange axis; now {1e3 * now:.0f} mm)"
        said.append(Paragraph(f"{text}; the new one contributes {after.torque[j]:.2g} N m."))
    return said


def _beside(design: PayloadDesign, com: Array) -> float:
    """Return the distance of a centre of mass from the flange's axis [m]."""
    flange = design.carrying.flange
    return float(np.linalg.norm((flange.rotation.T @ (com - flange.origin))[:2]))


def _shapes(design: PayloadDesign) -> Table:
    return table(
        design.candidates,
        column("Shape", lambda each: Cell(each.weight.shape, Mood.BAD if each.refusal else Mood.PLAIN), words=True),
        column(
            "Dimensions [mm]", lambda each: f"{each.weight.stated}, turned {90 * each.weight.quarter}\u00b0", words=True
        ),
        column("Mass [kg]", lambda each: f"{each.payload.mass:.3f}"),
        column("Off axis [mm]", lambda each: f"{_beside(design, np.array(each.payload.com)) / MM:.1f}"),
        column("Worst joint [%]", lambda each: percent(float(each.deviations.total[design.joints].max()), ".2f")),
    )


def _own_is_better(design: PayloadDesign) -> list[Paragraph]:
    """Return a sentence if the scenario's own payload is better when both are taken as fully known."""
    own, new = (design.worst(each.deviations) for each in (design.before, design.after))
    if own > new:
        return []
    return [
        Paragraph(
            (
                f"The scenario's own payload already identifies the worst joint better: {percent(own, '.2f')} "
                f"% against {percent(new, '.2f')} %; keep it."
            ),
            Mood.DOUBTFUL,
            strong=True,
        )
    ]


def _conclusion(design: PayloadDesign) -> list[Paragraph]:
    """Return a sentence on the accuracy with the new payload, preceded by a comparison with the scenario's own."""
    return [*_own_is_better(design), _identified(design)]


def _identified(design: PayloadDesign) -> Paragraph:
    shown = design.shows(design.after.deviations)
    missing = [str(j + 1) for j in design.joints if not shown[j]]
    if missing:
        return Paragraph(f"No payload within the limits identifies joint {', '.join(missing)}.", Mood.BAD, strong=True)
    return Paragraph(
        (
            f"The {design.best.weight.shape} identifies every joint; the worst gain's standard deviation is "
            f"{percent(float(design.after.deviations.total[design.joints].max()), '.2f')} %."
        ),
        Mood.GOOD,
        strong=True,
    )
