"""Every key of a TOML file is found at the line where it stands."""

import tomllib

from trajevo.base.toml import key_lines, line_of

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
