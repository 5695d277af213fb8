#!/usr/bin/env python3
"""Opens the page of a run in a headless browser, moves the mouse over its plots and reads the values there.

    tools/.venv/bin/python tests/browser/test_run_page.py RUN.html PANEL...    fails where a panel is missing
"""
import csv
import pathlib
import sys

from browser import browser, complaints, drag, hover, open_page, requests

page, panels = pathlib.Path(sys.argv[1]), sys.argv[2:]

VALUES = """return Object.fromEntries([...document.querySelectorAll('.stack .plot-head')].map((head) => [
    head.querySelector('.plot-title').textContent,
    [...head.querySelectorAll('.u-series:not(:first-child) .u-value')].map((value) => value.textContent)]))"""

def check(condition, what):
    if not condition:
        sys.exit(f"{page}: {what}")

with browser() as driver:
    seconds = open_page(driver, page)
    plots = driver.find_elements("css selector", ".stack .u-over")
    check(len(plots) > len(panels), f"{len(plots)} plots, expected the states and {panels}")
    for plot in plots:
        hover(driver, plot, 0.5, 0.5)
        values = driver.execute_script(VALUES)
        now = driver.find_element("css selector", ".now").text
        check("state: running" in now, f"in the middle of the run the states say {now!r}")
        for panel in panels:
            check(panel in values, f"no panel {panel!r} among {list(values)}")
            read = values[panel]
            check(any(c.isdigit() for value in read for c in value), f"{panel!r} reads {read} at the cursor")
    before = driver.execute_script("return reportPlots[0].plots[0].scales.x.max")
    drag(driver, plots[1], 0.2, 0.6)
    after = driver.execute_script("return reportPlots[0].plots.map((plot) => plot.scales.x.max)")
    check(all(end < before for end in after), f"zooming one plot should zoom all: {before} s, then {after}")
    lines = list(csv.reader(driver.execute_script("return reportPlots[0].csv()").splitlines()))
    inside = driver.execute_script("""const [axis] = reportPlots[0].axes, [from, to] = reportPlots[0].view;
        return axis.time.filter((time) => time >= from && time <= to).length""")
    check(len(lines) == inside + 1 > 100, f"{inside} samples are in view, the text has {len(lines)} lines")
    check(lines[0][1].startswith(f"{panels[0]}: ") and {len(line) for line in lines} == {len(lines[0])}, lines[0])
    events = driver.execute_script("""return [...document.querySelectorAll('section')]
        .find((section) => section.querySelector('h2')?.textContent === 'Events')?.querySelectorAll('tr').length""")
    check(events and events > 3, f"the table of events has {events} rows")
    said, asked = complaints(driver), requests(driver)
    check(not said, f"the console says {said}")
    check(not asked, f"the page asks for {asked}")
    headline = driver.find_element("css selector", ".headline").text
    print(f"{page.name}: {page.stat().st_size / 1e6:.1f} MB, drawn after {seconds:.2f} s: {headline}")
