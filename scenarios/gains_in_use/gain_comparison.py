"""The result of `rx90 verify` of two files of gains."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np

import ident.estimation.gain_comparison as gain_comparison
from ident.diagnosis.diagnosis import two_digits
from ident.estimation.gain_comparison import Moved, Together
from scenarios.rendering.content import Cell, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.rendering.wording import joints_named, percent, sentence, two_sigma
from scenarios.results.gains import common_unit
from scenarios.results.gains_file import GainsFile

MOVES = ("same", Mood.GOOD), ("MOVED", Mood.BAD), ("TURNED", Mood.BAD)  # a turned one has moved


@dataclass(frozen=True, slots=True, kw_only=True)
class MovedJoint(Moved):
    """Change of a joint's gain."""

    joint: int  # number of the joint, from 0
    apart: Moved  # its change relative to the common factor
    name: str  # name of the joint, or its number
    A: float  # gain in the first file, in `unit`
    B: float  # gain in the second file, at the current of the first one if both depend on it, in `unit`
    unit: str  # unit of the gain: N m/unit, or N/unit where the joint slides


class GainComparison(ResultModel):
    """What `rx90 verify A.toml B.toml --json` prints."""

    moved: bool  # whether a change is significant, of a joint or of all together
    joints: list[FromOne[MovedJoint]]  # joints with a gain in both files
    scale: Moved  # change common to most joints, or the mean if no majority has a common one
    scale_joints: list[int]  # joints with the common change; empty if these are not a majority
    together: Together  # chi-squared test of no change of any joint
    pattern: Together | None  # as `together`, of one change common to all; null for a single joint
    missing: list[dict[str, int | str]]  # joints with a gain in one file only
    limit: float  # number of standard deviations beyond which a joint's change is significant
    shared: list[str]  # recordings from which both files were identified, with correlated errors

    @classmethod
    def of(cls, found: gain_comparison.GainComparison, A: GainsFile, B: GainsFile) -> "GainComparison":
        """Return the result of a comparison of the gains of two files."""
        seen = {each.sha256 for each in B.recordings}
        value = B.known.at_currents_of(A.known.curves).by_joint
        return cls(
            moved=found.moved,
            joints=[
                MovedJoint(
                    **asdict(each),
                    joint=j,
                    apart=apart,
                    name=A.gains[j].name or B.gains[j].name or str(j + 1),
                    A=A.gains[j].estimate or 0.0,
                    B=value[j],
                    unit=f"{A.gains[j].torque_unit}/unit",
                )
                for j, each, apart in zip(found.joints.tolist(), found.each, found.apart, strict=True)
            ],
            scale=found.scale,
            scale_joints=[j + 1 for j in found.sharing.tolist()],
            together=found.together,
            pattern=found.pattern,
            missing=[{"joint": j + 1, "only_in": which} for j, which in found.missing],
            limit=found.limit,
            shared=sorted({each.name for each in A.recordings if each.sha256 in seen}),
        )

    def parts(self) -> Iterable[Part]:
        """Conclusion, the change of every joint, and the common factor."""
        unit, several = common_unit([each.unit for each in self.joints]), len(self.joints) > 1

        def apart(each: MovedJoint, name: str) -> float | None:
            return getattr(each.apart, name) if several else None

        yield self._conclusion()
        yield table(
            self.joints,
            column("Joint", lambda each: each.joint + 1),
            column("Name", lambda each: each.name, words=True),
            column(f"A [{unit}]", lambda each: f"{each.A:.4f}"),
            column(f"B [{unit}]", lambda each: f"{each.B:.4f}"),
            column("Change [%]", lambda each: percent(each.rel_change, "+.2f")),
            column("2 sigma,\nchange [%]", lambda each: two_sigma(each.rel_std)),
            column("Relative to\ncommon factor [%]", lambda each: percent(apart(each, "rel_change"), "+.2f")),
            column("2 sigma,\nrelative [%]", lambda each: two_sigma(apart(each, "rel_std"))),
            column("Verdict", lambda each: Cell(*MOVES[each.moved + each.turned]), words=True),
        )
        yield Paragraph(self._common())
        yield Paragraph(
            f"A verdict is MOVED beyond {self.limit:.2f} standard deviations of log(B/A) (5 % false alarms"
            f"{' for all joints together' if several else ''}). Changes and 2 sigma are in % of A."
        )
        for each in self.missing:
            yield Paragraph(f"Joint {each['joint']} has a gain in {each['only_in']} only.")
        if self.shared:
            yield Paragraph(
                f"WARNING: A and B share {', '.join(self.shared)}: their errors are correlated, so the intervals are "
                "not valid. Compare gains from separate recordings.",
                Mood.DOUBTFUL,
            )

    def _conclusion(self) -> Paragraph:
        moved = [each.joint + 1 for each in self.joints if each.moved]
        most = max(self.joints, key=lambda each: (each.turned, abs(np.log1p(each.rel_change)) / each.std))
        change = f"joint {most.joint + 1}, {_size(most)}"
        if moved:
            words = f"{joints_named(moved)} changed significantly ({f'most: {change}' if moved[1:] else _size(most)})"
        elif self.moved:
            words = f"the gains changed significantly as a whole (p = {self.together.p:.2g}), no single one did"
            apart = [f"joint {each.joint + 1}, {_size(each.apart)}" for each in self.joints if each.apart.moved]
            words += f"; relative to the common factor: {', '.join(apart)}" if apart and self.scale_joints else ""
        else:
            near = [each.joint + 1 for each in self.joints if abs(each.rel_change) > 2.0 * each.rel_std]
            limit = f"; beyond 2, within {self.limit:.2f} standard deviations: {joints_named(near)}" if near else ""
            return Paragraph(f"SAME: no gain changed significantly (most: {change}{limit}).", Mood.GOOD, strong=True)
        return Paragraph(sentence(f"MOVED: {words}"), Mood.BAD, strong=True)

    def _common(self) -> str:
        """Return the common factor and its joints."""
        joints, scale = [each.joint + 1 for each in self.joints], self.scale
        if len(joints) == 1:
            return f"Only joint {joints[0]} has a gain in both files, so a common factor is unknown."
        if not self.scale_joints:
            return (
                "No change is common to more than half of the joints. Changes relative to the mean of all joints, "
                f"{100.0 * scale.rel_change:+.2f} %, do not show which joint's gain changed."
            )
        alone = ", ".join(str(joint) for joint in joints if joint not in self.scale_joints)
        whose, size = f"all joints{' but ' if alone else ''}{alone}", f"{100.0 * scale.rel_change:+.2f} %"
        check = "; significant, check the payload masses and current units of A and B" if scale.moved else ""
        return f"Change common to {whose}: {size}, 2 sigma {200.0 * scale.rel_std:.2f} %{check}."


def _size(change: Moved) -> str:
    """Return a change with its interval, in words."""
    sign = "opposite sign, size " if change.turned else ""
    return f"{sign}{two_digits(100.0 * change.rel_change, sign='+')} %, 2 sigma {two_digits(200.0 * change.rel_std)} %"
