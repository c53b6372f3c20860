"""Result of `rx90 verify A B`: which gains changed significantly between two files, and whether by a common factor."""

from collections.abc import Iterable

import numpy as np
from pydantic import Field

import ident.estimation.gain_comparison as gain_comparison
from ident.diagnosis.alternative import two_digits
from scenarios.experiments.gains_file import TURNING, GainsFile
from scenarios.rendering.content import (
    Cell,
    Mood,
    Paragraph,
    Part,
    Table,
    column,
    joints_named,
    percent,
    sentence,
    table,
    two_sigma,
)
from scenarios.rendering.result import ResultModel
from scenarios.results.gains import common_unit, gain_units


class Moved(ResultModel):
    """Change of a gain.

    Attributes:
        rel_change: Relative change of its magnitude, |g_B / g_A| - 1.
        std: Standard deviation of log |g_B / g_A|, for small changes equal to that of the relative change.
        rel_std: Standard deviation of `rel_change`, `std` times |g_B / g_A|; relative.
    """

    rel_change: float
    std: float
    rel_std: float
    turned: bool = Field(description="Whether the sign of the gain changed")
    moved: bool = Field(description="Whether the change is significant")

    @classmethod
    def of(cls, each: gain_comparison.Moved) -> "Moved":
        """Return a change."""
        return cls(rel_change=each.rel, std=each.std, rel_std=each.rel_std, turned=each.turned, moved=each.moved)

    @property
    def size(self) -> str:
        """Change with its interval, in words."""
        return f"{two_digits(100.0 * self.rel_change, sign='+')} %, 2 sigma {two_digits(200.0 * self.rel_std)} %"


class _Numbered(ResultModel):
    joint: int = Field(ge=1, description="Number of the joint, from 1")


class MovedJoint(Moved, _Numbered):
    """Change of a joint's gain; `apart`: relative to the common factor.

    Attributes:
        apart: Its change relative to the common factor.
        name: Name of the joint, or its number.
        A: Gain in the first file, in `unit`.
        B: Gain in the second file, in `unit`.
        unit: Unit of the gain: N m/unit, or N/unit where the joint slides.
    """

    apart: Moved
    name: str
    A: float
    B: float
    unit: str


class ChiSquare(ResultModel):
    """A test of all joints together.

    Attributes:
        chi2: Sum of the squared changes over their standard deviations, with correlations between joints.
        freedom: Degrees of freedom.
        p: Probability of a value at least as large without a change.
    """

    chi2: float
    freedom: int
    p: float

    @classmethod
    def of(cls, test: gain_comparison.Together) -> "ChiSquare":
        """Return a test."""
        return cls(chi2=test.chi2, freedom=test.freedom, p=test.p)

    def in_words(self, what: str) -> str:
        """Return the test in words."""
        return f"{what}: chi2 = {self.chi2:.3g}, degrees of freedom = {self.freedom}, p = {self.p:.2g}."


class GainComparison(ResultModel):
    """What `rx90 verify A.toml B.toml --json` prints.

    Attributes:
        moved: Whether a change is significant, of a joint or of all together.
        joints: Joints with a gain in both files.
        scale: The change common to most joints, or the mean change if no majority has a common one.
        scale_joints: Numbers of the joints with the common change; empty if these are not a majority.
        together: Chi-squared test of no change of any joint.
        pattern: Chi-squared test of one change common to all joints, null for a single joint.
        limit: Number of standard deviations beyond which a joint's change is significant.
        shared: Names of recordings from which both files were identified; their errors are then correlated.
    """

    moved: bool
    joints: list[MovedJoint]
    scale: Moved
    scale_joints: list[int]
    together: ChiSquare
    pattern: ChiSquare | None
    missing: list[dict[str, int | str]] = Field(description="Joints with a gain in one file only")
    limit: float
    shared: list[str]

    @classmethod
    def of(cls, found: gain_comparison.GainComparison, A: GainsFile, B: GainsFile) -> "GainComparison":
        """Return the result of a comparison of the gains of two files."""
        seen = {each.sha256 for each in B.recordings}
        return cls(
            moved=found.moved,
            joints=[
                MovedJoint(
                    joint=j + 1,
                    **Moved.of(each).model_dump(),
                    apart=Moved.of(apart),
                    name=A.gains[j].name or B.gains[j].name or str(j + 1),
                    A=A.gains[j].estimate or 0.0,
                    B=B.gains[j].estimate or 0.0,
                    unit=gain_units([A.gains[j].unit == TURNING])[0],
                )
                for j, each, apart in zip(found.joints.tolist(), found.each, found.apart, strict=True)
            ],
            scale=Moved.of(found.scale),
            scale_joints=[j + 1 for j in found.sharing.tolist()],
            together=ChiSquare.of(found.together),
            pattern=None if found.pattern is None else ChiSquare.of(found.pattern),
            missing=[{"joint": j + 1, "only_in": which} for j, which in found.missing],
            limit=found.each[0].limit,
            shared=sorted({each.name for each in A.recordings if each.sha256 in seen}),
        )

    def parts(self) -> Iterable[Part]:
        """Conclusion, every joint's change, the common factor, and two tests of all joints."""
        yield self._conclusion()
        yield self._changes()
        yield Paragraph(self._common())
        yield Paragraph(
            f"A verdict is MOVED beyond {self.limit:.2f} standard deviations of log(B/A) (5 % false alarms"
            f"{' for all joints together' if self.joints[1:] else ''}). Changes and 2 sigma are in % of A."
        )
        yield Paragraph(self.together.in_words("Test of no change"))
        if self.pattern is not None:
            yield Paragraph(self.pattern.in_words("Test of one change common to all joints"))
        for each in self.missing:
            yield Paragraph(f"Joint {each['joint']} has a gain in {each['only_in']} only.")
        if self.shared:
            yield Paragraph(
                f"WARNING: A and B share {', '.join(self.shared)}: their errors are correlated, so the intervals are "
                "not valid. Compare gains from separate recordings.",
                Mood.DOUBTFUL,
            )

    def _conclusion(self) -> Paragraph:
        moved = [each.joint for each in self.joints if each.moved]
        most = max(self.joints, key=lambda each: (each.turned, abs(np.log1p(each.rel_change)) / each.std))
        change = f"joint {most.joint}, {most.size}"
        if moved:
            words = f"{joints_named(moved)} changed significantly ({f'most: {change}' if moved[1:] else most.size})"
        elif self.moved:
            words = f"the gains changed significantly as a whole (p = {self.together.p:.2g}), no single one did"
            apart = [f"joint {each.joint}, {each.apart.size}" for each in self.joints if each.apart.moved]
            words += f"; relative to the common factor: {', '.join(apart)}" if apart and self.scale_joints else ""
        else:
            near = [each.joint for each in self.joints if abs(each.rel_change) > 2.0 * each.rel_std]
            limit = f"; beyond 2, within {self.limit:.2f} standard deviations: {joints_named(near)}" if near else ""
            return Paragraph(f"SAME: no gain changed significantly (most: {change}{limit}).", Mood.GOOD, strong=True)
        return Paragraph(sentence(f"MOVED: {words}"), Mood.BAD, strong=True)

    def _changes(self) -> Table:
        """Return the table of gains, changes, and changes relative to the common factor (not for a single joint)."""
        unit, several = common_unit([each.unit for each in self.joints]), len(self.joints) > 1
        return table(
            self.joints,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: each.name, words=True),
            column(f"A [{unit}]", lambda each: f"{each.A:.4f}"),
            column(f"B [{unit}]", lambda each: f"{each.B:.4f}"),
            column("Change [%]", lambda each: percent(each.rel_change, "+.2f")),
            column("2 sigma [%]", lambda each: two_sigma(each.rel_std)),
            column(
                "Relative to\ncommon factor [%]",
                lambda each: percent(each.apart.rel_change if several else None, "+.2f"),
            ),
            column("2 sigma [%]", lambda each: two_sigma(each.apart.rel_std if several else None)),
            column("Verdict", _verdict, words=True),
        )

    def _common(self) -> str:
        """Return the common factor and its joints."""
        scale, alone = self.scale, [each.joint for each in self.joints if each.joint not in self.scale_joints]
        if len(self.joints) == 1:
            return f"Only joint {self.joints[0].joint} has a gain in both files, so a common factor is unknown."
        if not self.scale_joints:
            return (
                "No change is common to more than half of the joints. Changes relative to the mean of all joints, "
                f"{100.0 * scale.rel_change:+.2f} %, do not show which joint's gain changed."
            )
        whose = f"all joints but {', '.join(map(str, alone))}" if alone else "all joints"
        return (
            f"Change common to {whose}: {100.0 * scale.rel_change:+.2f} %, 2 sigma {200.0 * scale.rel_std:.2f} %"
            f"{'; significant, check the payload masses and current units of A and B' if scale.moved else ''}."
        )


def _verdict(each: Moved) -> Cell:
    if each.turned:
        return Cell("TURNED", Mood.BAD)
    return Cell("MOVED", Mood.BAD) if each.moved else Cell("same", Mood.GOOD)
