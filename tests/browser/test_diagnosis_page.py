#!/usr/bin/env python3
"""Opens a diagnosis's report in a headless browser: the answer stands first, every plot is drawn, nobody complains.

    tools/.venv/bin/python tests/browser/test_diagnosis_page.py report.html WORDS    fails where the headline lacks WORDS
"""
import pathlib
import sys

from browser import browser, complaints, hover, open_page, requests

page, words = pathlib.Path(sys.argv[1]), sys.argv[2]

HEADINGS = [
    "Measured and simulated", "Where the error sits", "Causes, and what speaks for and against each", "Parameters",
    "What the error depends on", "What these data can't test", "What to measure next",
]


def check(condition, what):
    if not condition:
        sys.exit(f"{page}: {what}")


with browser() as driver:
    seconds = open_page(driver, page)
    headline = driver.find_element("css selector", ".headline").text
    check(words in headline, f"{words!r} is not in the headline {headline!r}")
    headings = [heading.text for heading in driver.find_elements("css selector", "h2")]
    missing = [heading for heading in HEADINGS if heading not in headings]
    check(not missing, f"no {missing} among {headings}")
    plots = driver.find_elements("css selector", ".u-over")
    check(len(plots) >= 5, f"{len(plots)} plots")
    for plot in plots:
        hover(driver, plot, 0.5, 0.5)
    said, asked = complaints(driver), requests(driver)
    check(not said, f"the console says {said}")
    check(not asked, f"the page asks for {asked}")
    print(f"{page.name}: {page.stat().st_size / 1e6:.1f} MB, {len(plots)} plots, drawn after {seconds:.2f} s: {headline}")
