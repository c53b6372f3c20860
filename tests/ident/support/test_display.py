from dataclasses import replace

import numpy as np
import pytest
from estimates import gain_estimate

from ident.diagnosis.diagnosis import Diagnosed
from ident.identification import Identification
from ident.unseen import Unseen, UnseenJoint


@pytest.fixture
def found() -> Identification:
    estimate = gain_estimate(-0.8, None, 2.5, std=0.05, reason="friction < load")
    return Identification(estimate, (), Diagnosed(diagnoses=()))


def test_a_frame_has_gains_with_units_and_deviations_and_reasons(found):
    frame = found.to_frame()
    assert frame.columns[:3].tolist() == ["joint", "gain [N (m)/unit]", "std [N (m)/unit]"]
    assert frame["joint"].tolist() == [1, 2, 3]
    np.testing.assert_array_equal(frame["gain [N (m)/unit]"], [-0.8, np.nan, 2.5])
    np.testing.assert_array_equal(frame["std [N (m)/unit]"], found.std.filled(np.nan))
    np.testing.assert_allclose(frame["payload_std [N (m)/unit]"], [0.8 * 0.02, np.nan, 2.5 * 0.02], rtol=1e-12)
    assert frame["reason"].isna().tolist() == [True, False, True]


def test_a_chart_has_the_gains_with_two_deviations_and_no_refused_one(found):
    (axes,) = found.plot().axes
    (bars,) = axes.containers
    ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments() if len(segment)])
    gain, std = found.gain.compressed(), found.std.compressed()
    np.testing.assert_allclose(ends, np.column_stack((gain - 2.0 * std, gain + 2.0 * std)), rtol=1e-12)
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["1", "2", "3"]
    assert axes.get_ylabel() == "gain [N (m)/unit], 2 sigma"


def test_a_notebook_shows_the_main_statement_and_escaped_cells(found):
    html = found._repr_html_()
    assert html.startswith("<p>Identification by ls-2011: 2 of 3 gains, +- 2 sigma</p><table><tr><th>joint</th>")
    assert "<td>friction &lt; load</td>" in html
    assert html.count("<tr>") == 4


def test_a_predicted_motion_is_shown_by_joint():
    joints = (UnseenJoint(joint=0), UnseenJoint(joint=1, rel_error=0.031, fitted_rel_error=0.02))
    unseen = Unseen(log="tool", loaded=False, verdict=None, rel_error=0.031, other_rel_error=None, joints=joints)
    frame = unseen.to_frame()
    assert frame["joint"].tolist() == [1, 2]
    np.testing.assert_array_equal(frame["rel_error"].astype(float), [np.nan, 0.031])
    assert "<p>Currents of tool predicted within 3.1 % of rms</p>" in unseen._repr_html_()
    better = replace(unseen, verdict="worse", other_rel_error=0.02)
    assert "3.1 % of rms, worse than with the other gains" in better._repr_html_()
    (axes,) = unseen.plot().axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [np.nan, 0.031])
    assert (axes.get_ylim()[0], axes.get_xlim()) == (0.0, (-0.5, 1.5))
