#!/usr/bin/env python3
"""Opens the scope of a running, armed instance, and does what an engineer does with it: looks, zooms, measures, triggers, saves,
reopens; in light and dark, and at a phone's width.

    tools/.venv/bin/python tests/browser/test_scope.py URL STEPVALVE    the command line moves the valve
"""
import json
import subprocess
import sys
import time

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from browser import browser, complaints, drag, hover, settle

url, stepvalve = sys.argv[1:3]
PATIENCE_S = 20


def check(condition, what):
    if not condition:
        sys.exit(f"scope: {what}")


def command(*arguments):
    subprocess.run([stepvalve, *arguments], check=True, capture_output=True)


class Page:
    def __init__(self, driver):
        self.driver = driver
        driver.get(url)
        self.wait("samples", "return scope.counts.rows > 500")

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def wait(self, what, script, *arguments):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            found = self.js(script, *arguments)
            if found:
                return found
            time.sleep(0.05)
        said = self.js("return document.getElementById('said').textContent")
        sys.exit(f"scope: waited in vain for {what}; the page says {said!r}, the console {complaints(self.driver)}")

    def press(self, key):
        ActionChains(self.driver).send_keys(key).perform()
        settle(self.driver)

    def click(self, selector):
        found = self.driver.find_element("css selector", selector)
        self.js("arguments[0].scrollIntoView({block: 'center'})", found)
        found.click()
        settle(self.driver)

    def plots(self):
        return self.driver.find_elements("css selector", ".u-over")

    def range(self):
        return self.js("return scope.view.bounds()")

    def seen(self):
        return self.js("return document.getElementById('seen').textContent")

    def fill(self, **values):
        """Sets the trigger's fields as a hand does: value, then the browser's own event."""
        self.js("""const form = document.getElementById('trigger-form');
            for (const [name, value] of Object.entries(arguments[0])) {
              form[name].value = value; form[name].dispatchEvent(new Event('change', {bubbles: true})); }""", values)

    def trigger_state(self):
        return self.js("return document.getElementById('trigger-state').textContent")

    def feedback(self):
        """Cycles and angles of the capture in view, exactly."""
        return self.js("""const {topic, field} = scope.picker.signals.find(({name}) => name === 'feedback.angle_rad');
            const track = scope.view.tracks().of(topic);
            return [Array.from(track.cycles.subarray(0, track.length)), Array.from(track.columns.get(field).subarray(0, track.length))]""")


def look(page):
    page.wait("a view full of samples", "return scope.view.bounds()[0] > 0")
    before = page.range()
    time.sleep(0.5)
    check(page.range()[1] > before[1] + 200, f"the view stands still: {before} then {page.range()}")
    hover(page.driver, page.plots()[0], 0.95, 0.5)
    names = page.js("return document.querySelector('.names').textContent")
    check("mouse" in names and "°" in names, f"beside the plot stands {names!r}")
    page.press(Keys.SPACE)
    still = page.range()
    time.sleep(0.3)
    check(page.range() == still, "a paused view moves")
    page.press(Keys.SPACE)
    time.sleep(0.3)
    check(page.range()[1] > still[1], "the view does not go on after a pause")


def zoom_and_measure(page):
    drag(page.driver, page.plots()[0], 0.4, 0.6)
    narrow = page.range()
    check(900 < narrow[1] - narrow[0] < 1100, f"a fifth of 5 s was dragged over, and {narrow} is in view")
    hover(page.driver, page.plots()[0], 0.25, 0.5)
    page.press("a")
    hover(page.driver, page.plots()[0], 0.75, 0.5)
    page.press("b")
    a, b = page.js("return [scope.cursors.a, scope.cursors.b]")
    check(abs(b - a - (narrow[1] - narrow[0]) / 2) < 5, f"cursors at {a} and {b} in {narrow}")
    check(f"Δt {b - a}" in page.seen() and "1/Δt" in page.seen(), f"the bar says {page.seen()!r}")
    ActionChains(page.driver).key_down(Keys.SHIFT).send_keys(Keys.ARROW_RIGHT).key_up(Keys.SHIFT).perform()
    check(page.js("return scope.cursors.b") == b + 1, "Shift and an arrow move the cursor by one cycle")
    drag(page.driver, page.plots()[0], 0.25, 0.35)
    moved = page.js("return scope.cursors.a")
    check(moved > a + 50, f"cursor A was dragged from {a} and is at {moved}")
    check(page.range() == narrow, "dragging a cursor zooms")
    page.press("c")
    page.press("l")
    check(page.js("return scope.view.rolls()"), "L does not go back to what is live")


def trigger_and_save(page):
    # Triggered by a signal that is not shown.
    page.fill(mode="single", kind="change", signal="reference.target_angle_rad", pre="100", post="400")
    if not page.js("return document.getElementById('trigger-form').autosave.checked"):
        page.click("[name=autosave]")
    page.click("#apply")
    page.wait("an armed trigger", "return document.getElementById('trigger-state').textContent === 'armed'")
    command("set", "angle", "25deg")
    page.wait("a capture", "return scope.view.capture !== null")
    window = page.js("return scope.view.capture.window")
    check(window["trigger"] == window["zero"], f"{window}")
    check(window["to"] - window["from"] == 500 and window["zero"] - window["from"] == 100, f"{window}")
    cycles, angles = page.feedback()
    check(cycles == list(range(window["from"], window["to"] + 1)), f"{len(cycles)} samples from {cycles[0]}, window {window}")
    check(page.js("return scope.view.seconds(scope.view.capture.window.trigger)") == 0, "time zero is not the trigger")
    check("stopped" in page.trigger_state(), f"after a single capture the trigger is {page.trigger_state()!r}")
    page.wait("the capture's two files", "return scope.captures.saved.some(({name, hdf5}) => name.includes('change') && hdf5)")
    return cycles, angles


def reopen(page, cycles, angles):
    page.click("#live")
    check(page.js("return scope.view.capture") is None, "the button does not go back to what is live")
    saved = [button for button in page.driver.find_elements("css selector", "#capture-list button") if "capture-" in button.text]
    page.js("arguments[0].scrollIntoView({block: 'center'})", saved[0])
    saved[0].click()
    page.wait("the opened capture", "return scope.view.capture?.told.file")
    again = page.feedback()
    check(again == [cycles, angles], "the reopened capture differs from what was captured")
    page.click("#live")


def other_triggers(page):
    page.fill(mode="normal", kind="edge", signal="feedback.angle_rad", level="20", slope="falling", pre="50", post="200")
    page.click("#apply")
    page.wait("an armed trigger", "return document.getElementById('trigger-state').textContent === 'armed'")
    command("set", "angle", "10deg")
    page.wait("a capture", "return scope.view.capture?.told.word === 'edge'")
    cycles, angles = page.feedback()
    at = cycles.index(page.js("return scope.view.capture.window.trigger"))
    level = 20 * 3.141592653589793 / 180
    check(angles[at] <= level < angles[at - 1], f"around the trigger the angle is {angles[at - 1:at + 1]}, the level {level}")
    page.click("#live")
    page.fill(mode="normal", pre="50000")
    page.click("#apply")
    page.wait("a refusal", "return document.getElementById('said').textContent.includes('--history')")
    page.fill(mode="off", pre="100")
    page.click("#apply")
    page.wait("no trigger", "return document.getElementById('trigger-state').textContent === 'off'")


def narrow(page, width):
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": True}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.driver.refresh()
    page.wait("samples", "return window.scope && scope.counts.rows > 200")
    wide = page.js("return document.documentElement.scrollWidth")
    check(wide <= width, f"at {width} px the page is {wide} px wide")
    plot = page.plots()[0].size["width"]
    check(plot > 0.6 * width, f"at {width} px a plot is {plot} px wide")


with browser(1400, 1000) as driver:
    page = Page(driver)
    look(page)
    zoom_and_measure(page)
    captured = trigger_and_save(page)
    reopen(page, *captured)
    other_triggers(page)
    check("no gaps" in page.seen(), page.seen())
    check(not complaints(driver), f"the console says {complaints(driver)}")
    said = page.js("return [scope.counts, [...scope.latencies].sort((a, b) => a - b)[scope.latencies.length >> 1]]")
    print(f"scope: {json.dumps(said[0])}, publish to drawn {said[1]:.1f} ms (median)")
with browser(1400, 1000, dark=True) as driver:
    page = Page(driver)
    background = page.js("return getComputedStyle(document.body).backgroundColor")
    check(background == "rgb(20, 24, 28)", f"dark is {background}")
    narrow(page, 420)
    check(not complaints(driver), "the console is not empty")
