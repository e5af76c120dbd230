"""Pictures of power and energy: they show the numbers of the balance, and refuse anything else."""

import numpy as np
import pytest

from tests.capacity.test_drive_capacity import DOWN, UP
from tests.capacity.test_energy_balance import two_links
from tests.helpers import refused
from trajevo import energy_balance, plots


def test_curves_are_the_powers_and_their_sum():
    balance = energy_balance(two_links(DOWN))
    axes = plots.electrical_power(balance)
    shoulder, elbow, every = axes.get_lines()[:3]
    assert every.get_ydata() == pytest.approx(shoulder.get_ydata() + elbow.get_ydata())
    assert every.get_ydata().min() == pytest.approx(balance.least_power, rel=2e-3)
    assert axes.get_ylabel() == "electrical power [W]"
    assert np.trapezoid(every.get_ydata(), every.get_xdata()) == pytest.approx(balance.used.sum(), rel=2e-3)


def test_bars_of_joints_and_of_motions_add_up():
    balance = energy_balance(two_links(UP, standby_power=10.0), dwell=1.0)
    axes = plots.energy_uses(balance)
    heights = [bar.get_height() for bar in axes.patches]
    assert sum(heights) == pytest.approx(balance.used.sum())
    both = {"up": balance, "down": energy_balance(two_links(DOWN))}
    axes = plots.energy_uses(both)
    heights = [bar.get_height() for bar in axes.patches]
    assert sum(heights) == pytest.approx(sum(one.energy for one in both.values()))
    assert [text.get_text() for text in axes.get_xticklabels()] == ["up", "down"]
    assert axes.get_ylabel() == "energy [J]"


def test_other_things_are_refused_with_a_sentence():
    for picture in (plots.electrical_power, plots.energy_uses):
        refused(lambda picture=picture: picture(5), r"balance: expected what energy_balance\(motion\) gives, got int")
    refused(lambda: plots.energy_uses({}), "balances: expected at least one, got none")
    refused(lambda: plots.energy_uses({"a": 3}), "balance: expected what")
