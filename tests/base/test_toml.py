"""Every key of a TOML file is found at the line where it stands."""

import tomllib
from pathlib import Path
from typing import Annotated

import pydantic
import pytest

from tests.helpers import refused
from trajevo.base.toml import Places, key_lines, line_of, read_toml, validated

TEXT = """\
# a = 1
a = 1
"b c" = [
  1, # [
  { x = "]" },
]
d.e = 2
[t]  # comment
a = '''
[not.a.table]'''
[[p]]
x = 1
[[p]]
x = 2
[p.q]
y = "= no key"
"""


def test_keys_are_found_where_they_stand():
    lines = key_lines(TEXT)
    tomllib.loads(TEXT)
    assert lines[("a",)] == 2
    assert lines[("b c",)] == 3
    assert lines[("d", "e")] == 7
    assert lines[("t",)] == 8
    assert lines[("t", "a")] == 9
    assert lines[("p", 0)] == lines[("p",)] == 11
    assert lines[("p", 1, "x")] == 14
    assert line_of(lines, ("b c", 1, "x")) == 3
    assert line_of(lines, ("p", 1, "z")) == 13
    assert line_of(lines, ("nowhere",)) is None


def test_a_byte_order_mark_and_other_line_ends_are_read(tmp_path):
    file = tmp_path / "task.toml"
    file.write_bytes(b"\xef\xbb\xbfa = 1\r\nb = inf\r\nc = -inf # none\r\n")
    content, places = read_toml(file)
    assert content == {"a": 1, "b": float("inf"), "c": -float("inf")}
    assert places.lines[("b",)] == 2


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = 1\nb = 1e400\n", "line 2: expected a number up to 1.8e308, got 1e400; write inf for no limit"),
        ("a = [1.0,\n  -1.0e999]\n", "line 2: expected a number up to 1.8e308, got -1.0e999"),
        ("a = b\n", "line 1, column 5: cannot be read as TOML: expected a number, .*text in quotes, got a = b"),
        ("a = 1\n\na = 2\n", "line 3, column 6: .*this key is given twice, got a = 2"),
        ("[a]\n[a]\n", "line 2, column 3: .*this table is given twice, got .a."),
        ("a = 0,5\n", "line 1, column 6: .*expected a decimal point, not a comma, got a = 0,5"),
        ('a = "b\n', "line 1, column 7: .*a text is not closed by a quotation mark in its line"),
        ("a 1\n", "line 1, column 3: .*expected = after the key, got a 1"),
        ("a = [1, 2\n", "line 1.*: .*a list is not closed by ], got a = .1, 2"),
        ("a = { b = 1\n", "line 1.*a table is not closed by }"),
        ("= 1\n", "line 1, column 1: .*expected KEY = VALUE or .TABLE., got = 1"),
    ],
)
def test_what_cannot_be_read_is_told_with_line_and_remedy(tmp_path, text, says):
    file = tmp_path / "task.toml"
    file.write_text(text)
    refused(lambda: read_toml(file), rf"task\.toml: {says}")


def test_files_that_are_no_text_are_told(tmp_path):
    (tmp_path / "task.toml").write_bytes(b'a = 1\nb = "\xe4"\n')
    refused(lambda: read_toml(tmp_path / "task.toml"), "task.toml: line 2: cannot be read as TOML: is not UTF-8 text")
    refused(lambda: read_toml(tmp_path / "taks.toml"), "taks.toml: no such file; did you mean '.*/task.toml'")
    refused(lambda: read_toml(tmp_path), "expected a regular file, got a folder")


class _Table(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(strict=True)

    numbers: dict[str, Annotated[int, pydantic.Field(ge=0)] | list[Annotated[int, pydantic.Field(ge=0)]]] = {}
    sizes: Annotated[float, pydantic.Field(gt=0)] | list[float] = 1.0
    plain: int | list[int] = 1
    on: bool | list[str] = True


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({"numbers": {"5": "11"}}, "^a.toml: numbers.5: expected a whole number, got '11'$"),
        ({"numbers": {"5": -1}}, "^a.toml: numbers.5: expected a number greater than or equal to 0, got -1$"),
        ({"numbers": {"5": [-1]}}, "^a.toml: numbers.5.0: expected a number greater than or equal to 0, got -1$"),
        ({"sizes": -1.0}, "^a.toml: sizes: expected a number greater than 0, got -1.0$"),
        ({"plain": 1.5}, "^a.toml: plain: expected a whole number, got 1.5$"),
        ({"on": "perhaps"}, "^a.toml: on: .*, got 'perhaps'$"),
    ],
)
def test_places_have_the_keys_of_the_file_and_no_kind_of_value(content, says):
    refused(lambda: validated(_Table, content, Places(Path("a.toml"), {})), says)
