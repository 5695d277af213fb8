#!/usr/bin/env python3
"""Opens an investigation's page in a headless browser, wide and light, narrow and dark: the answer stands first, each step has
its plot, nobody complains.

    tools/.venv/bin/python tests/browser/test_investigation_page.py investigation.html STEPS WORDS
"""
import pathlib
import sys

from browser import browser, complaints, hover, open_page, requests

page, steps, words = pathlib.Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3]


def check(condition, what):
    if not condition:
        sys.exit(f"{page}: {what}")


for width, dark in [(1280, False), (420, True)]:
    with browser(width=width, dark=dark) as driver:
        open_page(driver, page)
        headline = driver.find_element("css selector", ".headline").text
        check(words in headline, f"{words!r} is not in the headline {headline!r}")
        rows = driver.find_element("css selector", "table").find_elements("css selector", "tbody tr")
        check(len(rows) == steps, f"{len(rows)} rows, expected {steps}")
        plots = driver.find_elements("css selector", ".u-over")
        check(len(plots) == steps, f"{len(plots)} plots, expected {steps}")
        for plot in plots:
            hover(driver, plot, 0.5, 0.5)
        wider = driver.execute_script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        check(wider <= 0, f"the page is {wider} pixels wider than its window")
        check(not complaints(driver), "the console has complaints")
        check(not requests(driver), "the page asks the network")
print(f"{page}: {steps} steps, {headline}")
