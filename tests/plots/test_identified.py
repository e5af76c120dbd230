"""The picture of an identified payload: marks and bars where they belong, and what is refused."""

import numpy as np
import pytest

from tests.capacity.identification.test_identify import ROBOT, TRUE, log, ten
from tests.helpers import refused
from trajevo import identify_payload, plots
from trajevo.robot.payload import PARAMETERS


def test_marks_and_bars_are_the_parameters_and_their_intervals():
    found = identify_payload(log(TRUE, np.random.default_rng(1)), ROBOT)
    ax = plots.identified_payload(found, TRUE)
    (drawn,), (bars,) = ([line for line in ax.lines if line.get_label() == "true"], ax.containers)
    scales = np.array([TRUE.mass, *3 * [abs(found.parameters[1:4]).max()], *6 * [abs(found.parameters[4:]).max()]])
    scales[0] = found.mass
    assert drawn.get_xdata() == pytest.approx(ten(TRUE) / scales)
    marks, _, (sticks,) = bars
    assert marks.get_xdata() == pytest.approx(found.parameters / scales)
    ends = np.array([stick[:, 0] for stick in sticks.get_segments()])
    assert np.diff(ends, axis=1)[:, 0] == pytest.approx(2.0 * found.doubt / scales)
    assert [label.get_text().split(" / ")[0] for label in ax.get_yticklabels()] == list(PARAMETERS)
    assert ax.get_yticklabels()[0].get_text() == f"m / {found.mass:.3g} kg"


def test_what_is_not_a_payload_is_refused():
    found = identify_payload(log(TRUE), ROBOT)
    refused(lambda: plots.identified_payload(TRUE), "found: expected what identify_payload")
    refused(lambda: plots.identified_payload(found, 2.3), "true: expected a trajevo.Payload")
