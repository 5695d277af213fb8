"""A headless Chromium, and what a hand does with a mouse in it.

Needs Debian's chromium and chromium-driver, and the Python packages of requirements.txt.
"""
import contextlib
import json
import os
import pathlib
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.chrome.service import Service

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
CHROMEDRIVER = os.environ.get("CHROMEDRIVER", "/usr/bin/chromedriver")
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
]


@contextlib.contextmanager
def browser(width=1280, height=900, dark=False):
    """A browser with a new, empty profile; ended and wiped afterwards."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for flag in [*FLAGS, f"--window-size={width},{height}", f"--user-data-dir={profile}"]:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        driver = webdriver.Chrome(options=options, service=Service(CHROMEDRIVER))
        try:
            scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
            driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
            driver.set_page_load_timeout(120)
            driver.set_script_timeout(60)
            yield driver
        finally:
            driver.quit()


def open_page(driver, path):
    """Opens a page; gives the seconds until all its plots were drawn."""
    requests(driver)  # what the page before asked for is not this one's
    begin = time.monotonic()
    driver.get(pathlib.Path(path).resolve().as_uri())
    settle(driver)
    return time.monotonic() - begin


def settle(driver):
    """Waits until the browser has painted twice, so that whatever was under way shows."""
    driver.execute_async_script(
        "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 0)));")


def offset(element, x, y):
    """From the middle of an element to a place given in fractions of its size, as Selenium counts."""
    size = element.size
    return round((x - 0.5) * size["width"]), round((y - 0.5) * size["height"])


def hover(driver, element, x, y):
    """Moves the mouse to a place on an element."""
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
    ActionChains(driver, duration=20).move_to_element_with_offset(element, *offset(element, x, y)).perform()
    settle(driver)


def drag(driver, element, x_from, x_to, y_from=0.5, y_to=0.5):
    """Drags the mouse over an element."""
    hover(driver, element, x_from, y_from)
    dx = round((x_to - x_from) * element.size["width"])
    dy = round((y_to - y_from) * element.size["height"])
    mouse = ActionChains(driver, duration=20).click_and_hold()
    mouse.move_by_offset(dx // 2, dy // 2).move_by_offset(dx - dx // 2, dy - dy // 2).release().perform()
    settle(driver)


def double_click(driver, element, x=0.5, y=0.5):
    """Double-clicks a place on an element."""
    hover(driver, element, x, y)
    ActionChains(driver, duration=20).double_click().perform()
    settle(driver)


def complaints(driver):
    """What the console has said since the last call."""
    return [f"{entry['level']}: {entry['message']}" for entry in driver.get_log("browser")]


def requests(driver):
    """Addresses asked for since the last call, those of the page itself and of data in it left out."""
    found = []
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            found.append(message["params"]["request"]["url"])
    page = driver.current_url
    return [url for url in found if url != page and not url.startswith("data:")]
