#!/usr/bin/env python3
"""Opens pages with plots in a headless browser, moves the mouse over them and looks at what happens.

    python3 -m venv tools/.venv && tools/.venv/bin/pip install -r tests/browser/requirements.txt
    apt-get install chromium chromium-driver
    tools/.venv/bin/python tests/browser/test_pages.py                 makes the sample pages, then tests them
    PAGES=FOLDER tools/.venv/bin/python tests/browser/test_pages.py    tests the sample pages of that folder
"""
import os
import pathlib
import subprocess
import tempfile
import unittest

from browser import browser, complaints, double_click, drag, hover, open_page, requests, settle

ROOT = pathlib.Path(__file__).resolve().parents[2]
# As in crates/report/examples/sample_pages.rs.
PEAK_AT = 0.618
PEAK = "123."
PANELS = ["Angle", "Following error", "Torque", "Torque reserve", "Pulse rate", "Pressure and flow", "Wake-up latency"]


def make_pages(folder):
    example = ["cargo", "run", "--quiet", "-p", "report", "--example", "sample_pages", "--", folder]
    subprocess.run(example, cwd=ROOT, check=True)


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = os.environ.get("PAGES")
        if cls.folder is None:
            made = tempfile.TemporaryDirectory()
            cls.addClassCleanup(made.cleanup)
            cls.folder = made.name
            make_pages(cls.folder)
        cls.driver = cls.enterClassContext(browser())

    def open(self, name):
        path = pathlib.Path(self.folder) / name
        seconds = open_page(self.driver, path)
        print(f"{name}: {path.stat().st_size / 1e6:.1f} MB, drawn after {seconds:.2f} s")
        # What the page before may have left is not this page's.
        self.addCleanup(self.check_quiet)
        return self.plots()

    def check_quiet(self):
        self.assertEqual(complaints(self.driver), [], "the console should be empty")
        self.assertEqual(requests(self.driver), [], "the page should ask for nothing")

    def plots(self):
        return self.driver.find_elements("css selector", ".u-over")

    def run_js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def text(self, selector):
        return self.run_js("return document.querySelector(arguments[0]).textContent", selector)

    def values(self):
        """Title of each panel over time, and its legend's values."""
        return self.run_js("""return Object.fromEntries([...document.querySelectorAll('.stack .plot-head')].map((head) => [
            head.querySelector('.plot-title').textContent,
            [...head.querySelectorAll('.u-series:not(:first-child) .u-value')].map((value) => value.textContent)]))""")

    def error_near(self, plot, time):
        """What the following error's legend says with the mouse on the three pixels around a time."""
        place = self.run_js("const [plot] = reportPlots[0].plots; return plot.valToPos(arguments[0], 'x')", time)
        width = plot.size["width"]
        read = []
        for pixel in (-1, 0, 1):
            hover(self.driver, plot, (place + pixel) / width, 0.5)
            read += self.values()["Following error"]
        return " ".join(read)

    def time_ranges(self):
        return self.run_js("return reportPlots[0].plots.map(({ scales: { x } }) => [x.min, x.max])")

    def ink(self):
        """For each canvas, how many of its pixels have a strong colour, as lines do and axes don't."""
        return self.run_js("""return [...document.querySelectorAll('canvas')].map((canvas) => {
            const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
            copy.drawImage(canvas, 0, 0);
            const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
            let coloured = 0;
            for (let i = 0; i < data.length; i += 4) {
              const [r, g, b, a] = data.subarray(i, i + 4);
              if (a > 128 && Math.max(r, g, b) - Math.min(r, g, b) > 60) coloured++;
            }
            return coloured;
        })""")

    def check_ranges(self, expected_from, expected_to, tolerance):
        for found_from, found_to in self.time_ranges():
            self.assertAlmostEqual(found_from, expected_from, delta=tolerance)
            self.assertAlmostEqual(found_to, expected_to, delta=tolerance)

    def check_run(self, name, samples):
        """Everything that a run's page promises, whatever the run's length."""
        plots = self.open(name)
        self.assertEqual(len(plots), 1 + len(PANELS) + 2, "strips, panels, histograms")
        for canvas, coloured in enumerate(self.ink()):
            self.assertGreater(coloured, 50, f"canvas {canvas} should show lines")
        end = (samples - 1) * 1e-3
        strips, panels, histograms = plots[0], plots[1:-2], plots[-2:]
        self.check_ranges(0, end, 1e-9)

        for plot in [strips, *panels]:
            hover(self.driver, plot, 0.3, 0.5)
            values = self.values()
            self.assertIn("state: running", self.text(".now"))
            for panel in PANELS:
                self.assertTrue(all(any(c.isdigit() for c in value) for value in values[panel]), f"{panel}: {values}")
        peak = int(samples * PEAK_AT) * 1e-3
        self.assertIn(PEAK, self.error_near(panels[2], peak), "the only peak shows, the mouse in another panel")

        drag(self.driver, panels[4], 0.5, 0.75)
        self.check_ranges(0.5 * end, 0.75 * end, 0.003 * end)
        self.assertTrue(self.driver.find_element("css selector", ".toolbar button").is_enabled())
        self.assertIn(PEAK, self.error_near(panels[1], peak), "the peak is still there, zoomed in")
        double_click(self.driver, strips, 0.4)
        self.check_ranges(0, end, 1e-9)
        drag(self.driver, strips, 0.8, 0.1)
        self.check_ranges(0.1 * end, 0.8 * end, 0.003 * end)
        self.driver.find_element("css selector", ".toolbar button").click()
        settle(self.driver)
        self.check_ranges(0, end, 1e-9)

        hover(self.driver, panels[0], 0.95, 0.5)
        self.assertIn("fault: feedback silent", self.text(".now"))
        self.assertEqual(self.values()["Following error"], ["–"], "no reference after the fault: a gap")
        for histogram in histograms:
            hover(self.driver, histogram, 0.05, 0.5)
        counts = self.run_js("return [...document.querySelectorAll('.beside .u-value')].map((v) => v.textContent)")
        self.assertTrue(any(" in " in count and "µs" in count for count in counts), counts)

    def test_a_short_run(self):
        self.check_run("run.html", 6_000)
        self.assertIn("6\u202f000 samples, all in this page", self.text("figure.plot > .note"))
        self.assertEqual(len(self.driver.find_elements("css selector", "details[open]")), 0)
        pre = self.run_js("return document.querySelector('details pre').textContent")
        self.assertIn("</script><b>", pre, "the scenario's text is shown as text")

    def test_a_hundred_thousand_samples(self):
        self.check_run("run-100k.html", 100_000)

    def test_ten_million_samples(self):
        self.check_run("run-10m.html", 10_000_000)
        self.assertLess((pathlib.Path(self.folder) / "run-10m.html").stat().st_size, 15e6)
        seen = self.text(".toolbar .seen")
        self.assertRegex(seen, r"10\u202f000\u202f000 samples · each pixel column shows the smallest and largest of \d")
        self.run_js("reportPlots[0].show([4000, 4020])")
        settle(self.driver)
        self.assertIn("(the page holds no more)", self.text(".toolbar .seen"))
        self.run_js("reportPlots[0].show([8999.99, 9000.01])")
        settle(self.driver)
        self.assertNotIn("largest", self.text(".toolbar .seen"), "around the fault every sample is there")
        self.assertIn("21 samples", self.text(".toolbar .seen"))

    def test_odd_signals(self):
        plots = self.open("odd.html")
        self.assertEqual(len(plots), 7)
        self.assertIn("<script>", self.driver.title)
        self.assertEqual(self.run_js("return document.querySelectorAll('main img').length"), 0)
        for plot in plots:
            hover(self.driver, plot, 0.5, 0.5)
        hover(self.driver, plots[0], 0.5, 0.5)
        values = self.values()
        self.assertEqual(values["Constant"], ["40.000 °C"])
        self.assertEqual(values["Missing"], ["–"])
        ink = self.ink()
        self.assertGreater(ink[4], 50, "lone samples show as points")
        self.assertGreater(ink[6], 5, "a single sample shows as a point")

    def test_runs_within_one_column_of_pixels(self):
        self.open("short-runs.html")
        columns = self.run_js("""const canvas = document.querySelector('canvas');
            const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
            copy.drawImage(canvas, 0, 0);
            const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
            const strong = (x) => Array.from({ length: canvas.height }).some((_, y) => {
              const [r, g, b, a] = data.subarray(4 * (y * canvas.width + x), 4 * (y * canvas.width + x) + 4);
              return a > 60 && Math.max(r, g, b) - Math.min(r, g, b) > 40;
            });
            return Array.from({ length: canvas.width }, (_, x) => strong(x));""")
        drawn = sum(now and not before for before, now in zip([False, *columns], columns))
        self.assertEqual(drawn, 12, "each of the runs should be seen")

    def test_an_empty_run(self):
        self.assertEqual(self.open("empty.html"), [])
        self.assertIn("No samples.", self.text("main"))

    def test_x_over_y(self):
        plots = self.open("xy.html")
        self.assertEqual(len(plots), 4)
        ranges = "const { x, y } = reportPlots[0].plot.scales; return [x.min, x.max, y.min, y.max]"
        whole = self.run_js(ranges)
        y = self.run_js("const { plot } = reportPlots[0]; return plot.valToPos(3, 'y') / plot.over.clientHeight")
        hover(self.driver, plots[0], 0.2, y)
        value = self.text(".beside .u-value")
        self.assertIn("N·m at", value)
        drag(self.driver, plots[0], 0.2, 0.6, 0.1, 0.8)
        zoomed = self.run_js(ranges)
        self.assertTrue(whole[0] < zoomed[0] < zoomed[1] < whole[1], (whole, zoomed))
        self.assertTrue(whole[2] < zoomed[2] < zoomed[3] < whole[3], (whole, zoomed))
        double_click(self.driver, plots[0])
        self.assertEqual(self.run_js(ranges), whole)

    def test_rows_open_and_selected_samples_light_up(self):
        plots = self.open("linked.html")
        shown = lambda: [plot for plot in self.plots() if plot.is_displayed()]
        self.assertEqual(len(plots), 3, "one open row, two covariates")
        rows = self.driver.find_elements("css selector", "tr.opens")
        self.assertEqual([row.text.split()[1] for row in rows], [f"<{run}>" for run in range(6)])
        rows[3].find_element("css selector", "button").click()
        settle(self.driver)
        self.assertEqual(len(shown()), 4)
        self.assertEqual(rows[3].find_element("css selector", "button").get_attribute("aria-expanded"), "true")
        rows[3].find_element("css selector", "td:nth-child(2)").click()
        settle(self.driver)
        self.assertEqual(len(shown()), 3)
        # Two wild samples don't flatten the rest; a double click shows them.
        y = "const { y } = reportPlots.at(-1).plots[0].drawn.plot.scales; return [y.min, y.max]"
        self.assertLess(self.run_js(y)[1], 2)
        self.assertIn("4 of 6\u202f000 points lie outside", self.text("section:last-of-type figure > .note:last-child"))
        over_speed = [plot for plot in shown() if plot.is_displayed()][-2]
        double_click(self.driver, over_speed)
        self.assertGreater(self.run_js(y)[1], 50)
        double_click(self.driver, over_speed)
        self.assertLess(self.run_js(y)[1], 2)
        # Fast samples forwards are those of the last two runs.
        before = self.ink()
        drag(self.driver, over_speed, 0.75, 0.98, 0.1, 0.9)
        said = self.text(".selected")
        self.assertRegex(said, r"of 3\u202f000 samples selected, in run <5> \(\d+\), run <4>")
        lit = [row.text.split()[1] for row in self.driver.find_elements("css selector", "tr.opens.lit")]
        self.assertEqual(lit, ["<4>", "<5>"])
        self.assertNotEqual(before, self.ink(), "the others are paler")
        # A covariate more shows the same selection; letting go clears all.
        buttons = self.driver.find_elements("css selector", ".picker button")
        self.assertEqual([button.get_attribute("aria-pressed") for button in buttons], ["true", "true", "false"])
        buttons[2].click()
        settle(self.driver)
        self.assertEqual(len(shown()), 4)
        double_click(self.driver, shown()[-1])
        self.assertEqual(self.driver.find_elements("css selector", "tr.lit"), [])
        self.assertIn("Drag over samples", self.text(".selected"))
        buttons[0].click()
        settle(self.driver)
        self.assertEqual(len(shown()), 3)

    def test_hiding_a_series_shows_the_others_larger(self):
        self.open("linked.html")
        y = "const { y } = reportPlots.at(-1).plots[0].drawn.plot.scales; return [y.min, y.max]"
        whole = self.run_js(y)
        legend = "reportPlots.at(-1).plots[0].drawn.head.querySelectorAll('.u-series .u-marker')"
        self.run_js(f"{legend}[1].parentElement.click()")
        settle(self.driver)
        self.assertNotEqual(self.run_js(y), whole, "the given model alone, its wild samples too")
        self.run_js(f"{legend}[1].parentElement.click()")
        settle(self.driver)
        self.assertEqual(self.run_js(y), whole)

    def test_a_series_has_its_colour_in_every_plot(self):
        self.open("linked.html")
        marks = self.run_js("""return [...document.querySelectorAll('.u-series')].map((series) =>
            [series.querySelector('.u-label').textContent, getComputedStyle(series.querySelector('.u-marker')).backgroundColor])""")
        colours = {name: {colour for other, colour in marks if other == name} for name, _ in marks}
        self.assertEqual(set(colours), {"measured", "model", "given", "extended"})
        self.assertTrue(all(len(of) == 1 for of in colours.values()), colours)
        self.assertEqual(colours["model"], colours["given"], "both are the given model")
        self.assertEqual(len({colour for of in colours.values() for colour in of}), 3, colours)

    def plot_and_legend(self, index):
        """Where a plot and its legend are in the window."""
        return self.run_js("""const plot = document.querySelectorAll('.stack .uplot')[arguments[0]];
            const legend = plot.closest('.plot-row').querySelector('.u-legend');
            return { plot: plot.getBoundingClientRect().toJSON(), legend: legend.getBoundingClientRect().toJSON() };""", index)

    def test_hiding_a_signal_resizing_and_moving_with_the_wheel(self):
        plots = self.open("run.html")
        wide = self.plot_and_legend(1)
        self.assertGreaterEqual(wide["legend"]["left"], wide["plot"]["right"], "where there is room the legend stands beside its plot")
        self.driver.set_window_size(800, 700)
        self.addCleanup(self.driver.set_window_size, 1280, 900)
        settle(self.driver)
        narrow = self.plot_and_legend(1)
        self.assertLessEqual(narrow["legend"]["bottom"], narrow["plot"]["top"] + 1, "else above it")
        self.assertLess(narrow["plot"]["right"], wide["plot"]["right"] - 100)
        self.assertLessEqual(self.run_js("return document.documentElement.scrollWidth"), 800, "nothing sticks out")
        wheel = "arguments[0].dispatchEvent(new WheelEvent('wheel', {deltaY: arguments[1], ctrlKey: arguments[2], " \
                "shiftKey: !arguments[2], clientX: 400, bubbles: true, cancelable: true}))"
        self.run_js(wheel, plots[1], -100, True)
        settle(self.driver)
        (low, high), *others = self.time_ranges()
        self.assertTrue(all(other == [low, high] for other in others))
        self.assertTrue(0 < low < high < 5.999)
        self.run_js(wheel, plots[1], 100, False)
        settle(self.driver)
        self.assertGreater(self.time_ranges()[0][0], low)
        before = self.ink()[3]
        self.driver.find_element("css selector", ".stack .u-legend tr:nth-child(4) th").click()
        settle(self.driver)
        shown = self.run_js("return reportPlots[0].plots[3].series.map((series) => series.show)")
        self.assertEqual(shown, [True, True, True, False])
        self.assertNotEqual(self.ink()[3], before)

    def test_dark(self):
        with browser(dark=True) as driver:
            open_page(driver, pathlib.Path(self.folder) / "run.html")
            background = driver.execute_script("return getComputedStyle(document.body).backgroundColor")
            self.assertEqual(background, "rgb(20, 24, 28)")
            self.assertEqual(complaints(driver), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
