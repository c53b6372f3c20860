"""Plots of gains: intervals, their contributions, and errors if the true gains are known."""

from collections.abc import Mapping, Sequence

from scenarios.reports.content import Paragraph
from scenarios.reports.plot import Axis, Mark, Plot, Series, Tone, about, intervals, values
from scenarios.results.models.gains import ResultGain

JOINT = "joint"


def error_plot(gains: Sequence[ResultGain]) -> Plot:
    """Return the plot of errors with their intervals and the tolerance; joints without a gain are empty."""
    names = tuple(str(gain.joint) for gain in gains)
    found = [gain for gain in gains if gain.rel_error is not None]
    there = [str(gain.joint) for gain in found]
    errors = [about(100.0 * (g.rel_error or 0.0), 200.0 * (g.std or 0.0) / abs(g.true or 1.0)) for g in found]
    return Plot(
        title="Error of each gain, with its interval",
        caption=(
            "Point: identified minus injected gain. Bar: plus and minus two standard deviations, all contributions "
            "included. A 95 % interval should contain zero in 19 of 20 cases. Wide band: tolerance."
        ),
        x=Axis(title=JOINT, categories=names),
        y=Axis(title="error", unit="%", zero=True),
        series=(
            intervals("Tolerance", there, [about(0.0, 100.0 * (gain.tolerance or 0.0)) for gain in found], Tone.QUIET),
            intervals("Error, 2 sigma", there, errors, Tone.FIRST),
        ),
    )


def value_plot(gains: Sequence[ResultGain], nominal: Mapping[int, float] | None = None) -> Plot:
    """Return the plot of gains with intervals in percent, relative to a-priori gains if there are any."""
    found = [(gain.joint, gain.estimate, gain.std or 0.0) for gain in gains if gain.estimate is not None]
    if nominal:
        found = [(joint, estimate, std) for joint, estimate, std in found if nominal.get(joint)]
    about_what = "the a-priori gain" if nominal else "the gain"
    ends = list[tuple[float, float, float]]()
    for joint, estimate, std in found:
        middle = nominal[joint] if nominal else estimate
        ends.append(about(100.0 * (estimate / middle - 1.0), 200.0 * std / abs(middle)))
    return Plot(
        title=f"Interval of each gain, relative to {about_what}",
        caption=(
            "Bar: plus and minus two standard deviations, all contributions included. Refused joints have no number."
        ),
        x=Axis(title=JOINT, categories=tuple(str(gain.joint) for gain in gains)),
        y=Axis(title="gain", unit=f"% from {about_what}", zero=True),
        series=(intervals("Gain, 2 sigma", [str(joint) for joint, _, _ in found], ends, Tone.FIRST),),
    )


def share_plot(gains: Sequence[ResultGain]) -> Plot:
    """Return the plot of the contributions to each interval."""
    found = [(gain, abs(gain.estimate)) for gain in gains if gain.estimate is not None]
    shares = {
        "Residual": [(gain.residual_std or 0.0) / size for gain, size in found],
        "Payload": [(gain.payload_std or 0.0) / size for gain, size in found],
        "Model": [(gain.model_std or 0.0) / size for gain, size in found],
    }
    tones = (Tone.FIRST, Tone.SECOND, Tone.THIRD)
    return Plot(
        title="Contributions to the intervals",
        caption="Two standard deviations of each contribution; the half-width of the interval is the root of the sum "
        "of their squares.",
        x=Axis(title=JOINT, categories=tuple(str(gain.joint) for gain in gains)),
        y=Axis(title="2 sigma", unit="%", zero=True),
        series=tuple(
            Series(
                label=label,
                mark=Mark.BARS,
                tone=tone,
                x=tuple(str(gain.joint) for gain, _ in found),
                y=values([200.0 * share for share in numbers]),
            )
            for (label, numbers), tone in zip(shares.items(), tones, strict=True)
        ),
    )


def what_would_show(gains: Sequence[ResultGain], allowed: float) -> list[Paragraph]:
    """Return for each refused joint what data would identify its gain.

    `allowed` is the largest predicted relative standard deviation of a gain that is not refused.
    """
    return [
        Paragraph(f"Joint {gain.joint}: {_advice(gain.predicted_rel_std, allowed)}.")
        for gain in gains
        if not gain.identifiable
    ]


def _advice(predicted: float | None, allowed: float) -> str:
    if predicted is None:
        return "the data do not determine the accuracy of its gain; mount a payload whose weight loads the joint"
    factor = predicted / allowed
    if factor <= 1.0:
        return "its standard deviation is small enough; it was refused for the reason above"
    return (
        f"to identify it, use a payload with {_times(factor)} times the torque on it (farther from its "
        f"axis, or heavier; `rx90 payload` designs one), or record {_times(factor**2)} times as many rows "
        "of such motions"
    )


def _times(factor: float) -> str:
    """Return a factor above 1, rounded up so that it never reads as 1."""
    return f"{factor:.0f}" if factor >= 10.0 else f"{factor:.3g}"
