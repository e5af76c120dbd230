"""Plain data, and files of it from strangers: bounded in depth, in size, and in what they unpack to."""

import io
import json
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from tests.helpers import refused
from trajevo.base.plain import MOST_LEVELS, from_json, from_toml, plain_data, read_arrays
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


@pytest.mark.parametrize(("parse", "nested"), [(from_json, "[{}]"), (from_toml, "a = [{}]")])
def test_data_is_at_most_so_deep(parse, nested):
    within = "[" * (MOST_LEVELS - 2) + "]" * (MOST_LEVELS - 2)
    assert parse(nested.format(within))
    for depth in (MOST_LEVELS + 8, 3000):
        with pytest.raises(ValueError, match=f"at most {MOST_LEVELS} deep"):
            parse(nested.format("[" * depth + "]" * depth))


def test_a_number_of_more_digits_than_python_reads_is_a_sentence():
    for parse, text in ((from_json, "{}"), (from_toml, "a = {}")):
        with pytest.raises(ValueError, match="expected whole numbers of at most 4300 digits"):
            parse(text.format("9" * 5000))


def test_arrays_come_back_as_they_were_written(tmp_path):
    arrays = {
        "numbers": np.arange(6.0).reshape(2, 3),
        "columns": np.asfortranarray(np.arange(6).reshape(2, 3)),
        "text": np.array("ä"),
        "texts": np.array(["", "long"]),
        "none": np.zeros((0, 3)),
        "flags": np.array([True, False]),
    }
    np.savez(tmp_path / "a.npz", **arrays)
    np.savez_compressed(tmp_path / "b.npz", **arrays)
    for name in ("a.npz", "b.npz"):
        found = read_arrays(tmp_path / name)
        assert found.keys() == arrays.keys()
        for key, array in arrays.items():
            np.testing.assert_array_equal(found[key], array)
            assert found[key].dtype == array.dtype


def changed(file, **data):
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in data.items():
            archive.writestr(f"{name}.npy", content)


def test_an_array_takes_no_memory_that_its_bytes_do_not_fill(tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.zeros(3))
    whole = stream.getvalue()
    changed(tmp_path / "a.npz", x=whole.replace(b"(3,), }          ", b"(3000000000,), } "))
    refused(
        lambda: read_arrays(tmp_path / "a.npz"), r"a\.npz: .*'x.npy' says that it has shape \(3000000000,\) .*24 bytes"
    )
    changed(tmp_path / "a.npz", x=whole.replace(b"'<f8'", b"'|O8'"))
    refused(lambda: read_arrays(tmp_path / "a.npz"), "holds something else than numbers or text")
    changed(tmp_path / "a.npz", x=whole[:30])
    refused(lambda: read_arrays(tmp_path / "a.npz"), "holds something else than numbers or text")


def test_a_small_file_that_unpacks_to_a_large_one_is_refused_before_it_is_unpacked(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive, archive.open("x.npy", "w") as entry:
        for _ in range(258):
            entry.write(bytes(2**20))
    assert (tmp_path / "a.npz").stat().st_size < 2**19
    tracemalloc.start()
    refused(lambda: read_arrays(tmp_path / "a.npz"), "expected at most 10000 arrays of 256 MiB together, got 1 of 258")
    assert tracemalloc.get_traced_memory()[1] < 2**22
    tracemalloc.stop()


def test_an_array_that_is_given_twice_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        for _ in range(2):
            archive.writestr("x.npy", b"")
    refused(lambda: read_arrays(tmp_path / "a.npz"), "a.npz: .*the array 'x.npy' is given twice")
