"""The sheet of a payload in a browser: one page of A4, and no part of it beside a narrow screen."""

import re

from tests.page.sheet.test_sheet import motion
from trajevo import payload_sheet


def test_a_sheet_is_printed_on_one_page_and_fits_a_telephone(chromium, tmp_path):
    sheet = payload_sheet(motion(drives=True), dwell=1.0, supplementary={"elbow_joint": 2.0})
    page, _ = sheet.save(tmp_path / "sheet.html")
    for width in (390, 1100):
        shown = chromium.new_page(viewport={"width": width, "height": 900})
        shown.goto(page.as_uri())
        assert shown.evaluate("document.documentElement.scrollWidth") <= width
        shown.close()
    shown = chromium.new_page()
    shown.goto(page.as_uri())
    printed = shown.pdf(prefer_css_page_size=True)
    shown.close()
    assert re.findall(rb"/Type\s*/Pages.*?/Count (\d+)", printed, re.DOTALL) == [b"1"]
