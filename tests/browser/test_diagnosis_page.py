#!/usr/bin/env python3
"""Opens a diagnosis's report in a headless browser, wide and light, narrow and dark: the answer stands first, every plot is
drawn, runs open, what is selected lights up, nobody complains.

    tools/.venv/bin/python tests/browser/test_diagnosis_page.py report.html WORDS    fails where the headline lacks WORDS
"""
import pathlib
import sys

from browser import browser, complaints, double_click, drag, hover, open_page, requests, settle

page, words = pathlib.Path(sys.argv[1]), sys.argv[2]

HEADINGS = [
    "Measured and simulated", "Where the error sits", "Causes, and what speaks for and against each", "Parameters",
    "What the error depends on", "What these data can't test", "What remains, and what to do next", "The log itself",
]


def check(condition, what):
    if not condition:
        sys.exit(f"{page}: {what}")


def shown(driver):
    return [plot for plot in driver.find_elements("css selector", ".u-over") if plot.is_displayed()]


def look(driver):
    """What any reader sees."""
    seconds = open_page(driver, page)
    headline = driver.find_element("css selector", ".headline").text
    check(words in headline, f"{words!r} is not in the headline {headline!r}")
    headings = [heading.text for heading in driver.find_elements("css selector", "h2")]
    missing = [heading for heading in HEADINGS if heading not in headings]
    check(not missing, f"no {missing} among {headings}")
    plots = shown(driver)
    check(len(plots) >= 5, f"{len(plots)} plots")
    for plot in plots:
        hover(driver, plot, 0.5, 0.5)
    wider = driver.execute_script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
    check(wider <= 0, f"the page is {wider} pixels wider than its window")
    return seconds, headline, len(plots)


def open_run(driver):
    """The last run of the table opens and closes; errors are not larger than those of the rows before."""
    rows = driver.find_elements("css selector", "tr.opens")
    before = len(shown(driver))
    for more in (2, 0):
        rows[-1].find_element("css selector", "button").click()
        settle(driver)
        check(len(rows) == 1 or len(shown(driver)) == before + more, f"{before} plots, then {len(shown(driver))}: expected {more} more")
    names = [cell.text for cell in driver.find_elements("css selector", ".opening thead th")]
    column = max(index for index, name in enumerate(names) if name.startswith("error of the model"))
    errors = [float(row.find_elements("css selector", "td")[column].text.replace("\u2212", "-")) for row in rows]
    check(errors == sorted(errors, reverse=True), f"the worst run should stand first: {errors}")


def select(driver):
    """Samples selected in one plot light up in the others and in the table."""
    linked = driver.execute_script("return reportPlots.findIndex((plot) => plot.select)")
    place = f"reportPlots[{linked}].place"
    plots = [plot for plot in driver.execute_script(f"return [...{place}.querySelectorAll('.u-over')]") if plot.is_displayed()]
    drag(driver, plots[0], 0.55, 0.95, 0.05, 0.95)
    said = driver.find_element("css selector", ".selected").text
    lit = driver.find_elements("css selector", "tr.opens.lit")
    check("samples selected, in " in said and lit, f"{said!r}, {len(lit)} rows lit")
    double_click(driver, plots[-1])
    check(not driver.find_elements("css selector", "tr.lit"), "a double click should let go")
    buttons = driver.find_elements("css selector", ".picker button")
    check(len(buttons) >= 4, f"{len(buttons)} quantities to pick")
    hidden = next(button for button in buttons if button.get_attribute("aria-pressed") == "false")
    before = len(shown(driver))
    hidden.click()
    settle(driver)
    check(len(shown(driver)) == before + 1, f"picking {hidden.text!r} should show a plot")


with browser() as driver:
    seconds, headline, plots = look(driver)
    open_run(driver)
    select(driver)
    said, asked = complaints(driver), requests(driver)
    check(not said, f"the console says {said}")
    check(not asked, f"the page asks for {asked}")
    print(f"{page.name}: {page.stat().st_size / 1e6:.1f} MB, {plots} plots, drawn after {seconds:.2f} s: {headline}")
with browser(width=480, dark=True) as driver:
    look(driver)
    said = complaints(driver)
    check(not said, f"narrow and dark, the console says {said}")
