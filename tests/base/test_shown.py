"""Pieces of what notebooks show: one line of text, and HTML that is safe, small and in the colours of the page."""

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trajevo.base.shown import html
from trajevo.base.shown.brief import MOST, brief, cut
from trajevo.errors import one_line

#: Characters of texts, all that UTF-8 can encode: by name of that code, hypothesis tries a million of them.
CHARACTERS = st.characters(exclude_categories=["Cs"])


class Reader(HTMLParser):
    """Texts and tags of HTML; fails where tags do not match."""

    def __init__(self, text):
        super().__init__()
        self.texts, self.tags, self.open = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@dataclass(frozen=True)
class Thing:
    values: Any = None
    name: str = "thing"
    hidden: int = field(default=0, repr=False)

    __repr__ = brief


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (None, "Thing()"),
        (2.5, "Thing(values=2.5)"),
        (np.float64(0.1) + 0.2, "Thing(values=0.30000000000000004)"),
        (np.zeros((3, 7)), "Thing(values=<array 3×7>)"),
        (Thing(1), "Thing(values=Thing(…))"),
        ([Thing(1), np.ones(2)], "Thing(values=[Thing(…), <array 2>])"),
        (np.linspace, "Thing(values=<linspace>)"),
        ("two\nlines\x1b[31m", "Thing(values='two\\nlines\\x1b[31m')"),
        (range(3), "Thing(values=<3 range>)"),
    ],
)
def test_a_record_is_told_by_what_is_not_its_default(values, told):
    assert repr(Thing(values)) == told


def test_a_record_is_one_line_however_much_it_holds():
    wide = dataclass(type("Wide", (), {"__annotations__": {f"field_{k}": str for k in range(40)}, "__repr__": brief}))
    told = repr(wide(*("x" * 500 for _ in range(40))))
    assert told.startswith("Wide(field_0='xxx")
    assert told.endswith(", …)")
    assert MOST - 100 < len(told) <= MOST


def test_a_model_of_pydantic_is_told_too():
    class Model(pydantic.BaseModel):
        number: int = 1
        texts: list[str] = []
        __repr__ = brief

    assert repr(Model()) == "Model()"
    assert repr(Model(number=2, texts=["a"] * 9)) == "Model(number=2, texts=['a', 'a', 'a', 'a', ...])"


@given(st.text(CHARACTERS), st.integers(2, 40))
def test_a_text_is_cut_on_one_line(text, most):
    short = cut(text, most)
    assert len(short) <= most
    assert short.isprintable() or not one_line(text).isprintable()
    assert short == one_line(text) or (short.endswith("…") and one_line(text).startswith(short[:-1]))


@given(st.text(CHARACTERS, max_size=100))
def test_whatever_is_written_in_a_table_is_text(text):
    found = Reader(html.shown(text, html.sentence(text), html.table((text,), [(text,)]), html.facts({text: text})))
    assert {tag for tag, _ in found.tags} <= {"div", "b", "p", "table", "thead", "tbody", "tr", "th", "td"}
    assert one_line(text) in "".join(found.texts)


def test_a_name_cannot_become_a_tag_of_a_picture():
    evil = '"><script>alert(1)</script>'
    picture = html.cloud(np.eye(2), (evil, evil), {evil: np.zeros(2)}) + html.line(np.arange(3.0), evil)
    assert "script" not in {tag for tag, _ in Reader(picture).tags}
    assert "<script" not in picture


def test_a_long_table_says_how_much_it_leaves_out():
    found = Reader(html.table(("k", "of"), [(str(k), "x" * 999) for k in range(40)], most=5))
    assert [text for text in found.texts if text.isdecimal()] == list("01234")
    assert found.texts[-1] == "and 35 more"
    assert max(map(len, found.texts)) <= 120
    assert html.table(("k",), []) == ""


def test_numbers_stand_right_and_texts_left():
    tags = Reader(html.table(("name", "value"), [("joint", "-1.5 rad"), ("1st", "≤ 3 %"), ("x", "none")])).tags
    sides = [attributes["style"].split(";")[0] for tag, attributes in tags if tag in ("th", "td")]
    assert sides == ["text-align:left", "text-align:right"] * 4


def coordinates(path):
    return np.array([[float(x), float(y)] for x, y in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path)])


def test_a_cloud_lies_in_its_frame_and_keeps_order():
    points = np.random.default_rng(1).normal(size=(300, 2)) * [1e-6, 1e9]
    tags = Reader(html.cloud(points, ("x", "y"), {"here": points[7]})).tags
    frame = next(of for tag, of in tags if tag == "rect")
    corner, size = (np.array([float(frame[one]) for one in ends]) for ends in ("xy", ("width", "height")))
    drawn = coordinates(next(of["d"] for tag, of in tags if tag == "path"))
    assert len(drawn) == 300
    assert (drawn >= corner - 0.06).all()
    assert (drawn <= corner + size + 0.06).all()
    np.testing.assert_allclose(np.corrcoef(drawn[:, 0], points[:, 0])[0, 1], 1.0, atol=1e-5)
    np.testing.assert_allclose(np.corrcoef(drawn[:, 1], points[:, 1])[0, 1], -1.0, atol=1e-5)
    (ring,) = (of for tag, of in tags if tag == "circle")
    np.testing.assert_allclose([float(ring["cx"]), float(ring["cy"])], drawn[7])


@pytest.mark.parametrize("points", [np.ones((1, 2)), np.ones((5, 2)), np.empty((0, 2)), np.zeros((10_000, 2))])
def test_any_cloud_can_be_drawn(points):
    drawn = html.cloud(points, ("x", "y"), {})
    assert "nan" not in drawn
    assert len(drawn) < 10_000
    assert bool(drawn) == bool(len(points))


def test_a_line_is_broken_where_nothing_is_known():
    assert html.line(np.array([1.0, 2.0, np.nan, 3.0, 4.0]), "q").count("M") == 2
    assert html.line(np.full(4, np.nan), "q") == ""


@pytest.mark.parametrize("values", [np.full(30, 1.57), 1.57 + 1e-12 * np.arange(30.0), np.zeros(30)])
def test_what_stands_still_is_a_flat_line(values):
    drawn = coordinates(html.line(values, "q"))
    assert np.ptp(drawn[:, 1]) == 0.0
    assert np.ptp(drawn[:, 0]) > 100.0


def test_pictures_take_the_colours_of_the_page_and_tell_what_they_show():
    for picture in (html.cloud(np.eye(2), ("x", "y"), {"a": np.zeros(2)}), html.line(np.arange(4.0), "q of joint 1")):
        found = Reader(picture)
        colours = {value for _, of in found.tags for key, value in of.items() if key in ("fill", "stroke")}
        assert colours <= {"currentColor", "none"}
        assert found.tags[0][1]["role"] == "img"
        assert found.tags[0][1]["aria-label"] == found.texts[0]
