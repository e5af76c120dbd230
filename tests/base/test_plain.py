import json
from pathlib import Path

import numpy as np
import pytest

from trajevo.base.plain import plain_data
from trajevo.errors import InvalidInputError


def test_plain_data_is_equal_after_json():
    given = {
        "nested": ((1.0, 2.0), [np.float32(0.1), np.int64(3)]),
        "array": np.array([[0.1 * 3, -0.0], [1e-310, 1e22]]),
        "text": np.str_("a"),
        "flag": np.True_,
        "path": Path("a") / "b",
        "none": None,
        7: True,
    }
    plain = plain_data("settings", given)
    again = json.loads(json.dumps(plain))
    assert again == plain
    assert plain["nested"] == [[1.0, 2.0], [float(np.float32(0.1)), 3]]
    assert np.signbit(again["array"][0][1])
    assert again["array"][0][0] == 0.1 * 3
    assert list(plain) == ["nested", "array", "text", "flag", "path", "none", "7"]


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (float("inf"), "settings.a: expected finite numbers, got inf; for no limit, write the text 'inf'"),
        (np.array([1.0, np.nan]), "settings.a: expected finite numbers, got nan"),
        (1.0j, "settings.a: expected a number, text, list or table, got complex"),
        ({"b": object()}, "settings.a.b: expected a number, text, list or table, got object"),
        ("\udc80", "settings.a: expected text that can be written as UTF-8"),
    ],
)
def test_what_json_cannot_hold_is_refused_by_name(value, says):
    with pytest.raises(InvalidInputError, match=says.replace(".", r"\.")):
        plain_data("settings", {"a": value})
