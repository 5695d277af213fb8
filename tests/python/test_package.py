"""The Python package beside the command: the same numbers bit for bit, and what a user of pandas expects.

    PYTHONPATH=PACKAGE test_package.py STEPVALVE RIG REPOSITORY
"""
import concurrent.futures
import json
import multiprocessing
import os
import pathlib
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import h5py
import numpy as np
import pandas as pd

import stepvalve as sv

STEPVALVE, RIG, REPOSITORY = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
SCENARIOS = REPOSITORY / "rt-config/scenarios"
PLAN = """format = "stepvalve-campaign"
format_version = 1
name = "a few"
scenarios = ["scenario.toml"]
task = "{task}"
failure_limit = "100%"
[design]
kind = "latin-hypercube"
runs = {runs}
seed = 5
[[vary]]
path = "truth.friction.coulomb_torque_nm"
range = [0.5, 1.5]
as = "factor"
[[vary]]
path = "scenario.encoder.counts_per_turn"
values = [4000, 40000, 0]
"""


def command(*arguments):
    """What the command line does."""
    finished = subprocess.run([STEPVALVE, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


class Package(unittest.TestCase):
    """In a folder of its own."""

    def setUp(self):
        self.place = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.place)

    def same(self, one, other, what):
        """Bit for bit, NaN included."""
        self.assertEqual(one.dtype, np.float64, what)
        np.testing.assert_array_equal(one.view(np.uint64), np.asarray(other, np.float64).view(np.uint64), err_msg=what)

    def scenario(self, changes={}):
        """A short scenario in the folder, beside its models."""
        shutil.copytree(REPOSITORY / "rt-config/models", self.place / "models", dirs_exist_ok=True)
        (self.place / "scenarios").mkdir(exist_ok=True)
        short = {"duration": "1.5s", "set_point[1].time": "1.4s"}
        scenario = sv.Scenario.read(SCENARIOS / "sine-1hz.toml").with_values(short | changes)
        path = self.place / "scenarios/scenario.toml"
        path.write_text(scenario.text)
        return path

    def plan(self, runs, task="simulate"):
        self.scenario()
        path = self.place / "scenarios/plan.toml"
        path.write_text(PLAN.format(runs=runs, task=task))
        return path

    def test_a_run_is_run_h5(self):
        for name in ["sine-1hz", "flow-steps"]:
            run = sv.simulate(sv.Scenario.read(SCENARIOS / f"{name}.toml"))
            out = self.place / name
            command("simulate", SCENARIOS / f"{name}.toml", "--mode", "in-process", "--out", out)
            with h5py.File(out / "run.h5") as file:
                group = file["runs/closed-loop"]
                self.assertEqual(set(group), set(run.columns))
                for column in run:
                    # The unit before the values: a wrong column shows in either.
                    self.assertEqual(group[column].attrs["unit"], run.units[column], column)
                    self.same(run[column], group[column][()], f"{name}: {column}")
            frame = run.to_pandas()
            self.assertEqual((len(frame), frame.attrs["units"]["true_angle"]), (len(run), "rad"))
            self.assertLess(run.metrics["following_error_rms"], 0.01)

    def test_predictions_and_diagnoses_are_the_command_s(self):
        for kind, samples in [("torque", 12_000), ("angle", 20_000)]:
            rig, out = self.place / f"rig-{kind}", self.place / f"out-{kind}"
            hidden = ["--hidden", "coulomb-level", "--log", kind, "--samples", str(samples), "--seed", "4711"]
            subprocess.run([RIG, *hidden, "--out", rig], check=True, capture_output=True)
            log, model = sv.Log.read(rig / "log.h5"), sv.Model.read(rig / "model.toml")
            command("predict", "--log", rig / "log.h5", "--model", rig / "model.toml", "--out", rig / "pred.h5")
            with h5py.File(rig / "pred.h5") as file:
                for run in sv.predict(log, model):
                    for column in ("time", kind):
                        self.same(run[column], file[f"runs/{run.name}/{column}"][()], f"{run.name}: {column}")
            steps = []
            found = sv.diagnose(log, model, limit=None, progress=lambda what, part: steps.append(what))
            given = ["--log", rig / "log.h5", "--model", rig / "model.toml", "--out", out, "--limit", "30min"]
            printed = command("diagnose", *given)
            self.assertEqual(found.json, (out / "diagnosis.json").read_text())
            self.assertEqual(found.details, json.loads(found.json))
            self.assertEqual(found._native.extended_text(), (out / "model-extended.toml").read_text())
            self.assertIn(found.headline, printed)
            self.assertEqual(found.causes, ["coulomb-level"])
            self.assertEqual(list(found.parameters["cause"].unique()), found.causes)
            self.assertIn("planning the next experiment", steps)
            # The extended model predicts better what was measured.
            table = found.predicted
            rms = [np.sqrt(np.nanmean((table["measured"] - table[of]) ** 2)) for of in ("before", "after")]
            self.assertLess(rms[1], 0.9 * rms[0])
            with h5py.File(out / "residuals.h5") as file:
                for name, rows in table.groupby("run", sort=False):
                    for ours, theirs in [("before", "predicted_before"), ("after", "predicted_after"), ("deviation", "standard_deviation")]:
                        self.same(rows[ours].to_numpy(), file[f"runs/{name}/{theirs}"][()], f"{name}: {ours}")
            found.write(self.place / "written")
            self.assertEqual(sv.Model.read(self.place / "written/model-extended.toml").text, found.model.text)

    def test_a_table_of_pandas_becomes_the_same_log(self):
        rig = self.place / "rig"
        subprocess.run([RIG, "--seed", "3", "--samples", "12000", "--out", rig], check=True, capture_output=True)
        log = sv.Log.read(rig / "log.h5")
        table = log.to_pandas()
        table["Position"] = np.rad2deg(table.pop("angle"))
        table["note"] = "a text is left out"
        again = sv.Log.from_pandas(
            table, run="run", columns={"angle": "Position"}, units={"angle": "deg"}, title=log.title, angle_zero=log.angle_zero
        )
        self.assertEqual([run.name for run in again], [run.name for run in log])
        for run in log:
            np.testing.assert_allclose(again[run.name]["angle"], run["angle"], rtol=1e-15)
            self.same(again[run.name]["torque"], run["torque"], run.name)
            self.assertNotIn("note", again[run.name].columns)
        again.write(self.place / "again.h5")
        command("inspect", self.place / "again.h5")
        with self.assertRaises(FileExistsError):
            again.write(self.place / "again.h5")
        copy = pickle.loads(pickle.dumps(again))
        self.same(copy.runs[0]["torque"], again.runs[0]["torque"], "pickled")

    def test_campaigns_are_the_command_s_wherever_they_are_made(self):
        for task, runs in [("simulate", 12), ("both", 6)]:
            plan = self.plan(runs, task)
            out = self.place / f"campaign-{task}"
            command("campaign", plan, "--out", out)
            campaign = sv.Campaign.read(plan)
            self.assertEqual(len(campaign), runs)
            keep = self.place / f"rows-{task}.log"
            here = campaign.run(chunk=2, keep=keep)
            with h5py.File(out / "campaign.h5") as file:
                group = file["rows"]
                for column in here:
                    values = group[column][()]
                    if values.dtype.kind == "O":
                        self.assertEqual(list(here[column]), [value.decode() for value in values], column)
                    else:
                        self.assertEqual(here.attrs["units"][column], group[column].attrs.get("unit", ""), column)
                        np.testing.assert_array_equal(here[column].to_numpy(), values, err_msg=column)
            self.assertTrue((here["outcome"] == "not simulated").any(), "an encoder without counts is no scenario")
            # Killed in the middle of a row: rows that are there are not made again.
            whole, begins = keep.read_bytes(), len(campaign._native.head())
            keep.write_bytes(whole[: begins + 2 * (len(whole) - begins) // 3])
            pd.testing.assert_frame_equal(campaign.run(keep=keep), here)
            with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
                pd.testing.assert_frame_equal(campaign.run(pool, chunk=3), here)
        made = here[here["outcome"] == "done"].iloc[-1]
        run = campaign.scenario(int(made["run"]))
        self.assertEqual(run["duration"], "1.5s")
        self.assertEqual(sv.simulate(run).metrics["following_error_rms"], made["following_error_rms"])

    def test_too_many_failures_end_a_campaign(self):
        plan = self.plan(12)
        plan.write_text(plan.read_text().replace('"100%"', "1"))
        with self.assertRaisesRegex(sv.TooManyFailures, "expected at most 1") as raised:
            sv.Campaign.read(plan).run(chunk=1)
        self.assertLess(len(raised.exception.table), 12)

    def test_a_killed_worker_of_dask_costs_nothing(self):
        import distributed

        campaign = sv.Campaign.read(self.plan(40))
        expected = campaign.run()
        with distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            with distributed.Client(cluster) as client:
                victim = next(iter(client.run(os.getpid).values()))
                killed = []

                def progress(_, part):
                    if part > 0.2 and not killed:
                        killed.append(part)
                        os.kill(victim, signal.SIGKILL)

                made = campaign.run(client.get_executor(pure=False), chunk=2, progress=progress)
        self.assertTrue(killed)
        pd.testing.assert_frame_equal(made, expected)

    def test_what_is_wrong_is_named(self):
        with self.assertRaises(sv.InputError) as raised:
            sv.Model('format = "stepvalve-model"\nformat_version = 1\nname = "x"\n[friction]\nlaw = 3\n', "x.toml")
        self.assertIn(("x.toml", 5), [(problem["file"], problem["line"]) for problem in raised.exception.problems])
        self.assertIn("x.toml:5:", str(raised.exception))
        model = sv.Model.read(REPOSITORY / "rt-config/models/rig.toml")
        with self.assertRaisesRegex(sv.InputError, "friction.coulomb_torque_nm"):
            model["friction.coulomb_torque"]
        with self.assertRaisesRegex(sv.InputError, "coulomb_torque_nm"):
            model.with_values({"friction.coulomb_torque_nm": -1.0})
        with self.assertRaisesRegex(sv.InputError, "expected a number, a text or a truth value"):
            model.with_values({"friction.coulomb_torque_nm": [1.0]})
        table = pd.DataFrame({"time": [0.0, 0.1, 0.1], "angle": [0.0, 0.1, 0.2], "torque": [1.0, 1.0, 1.0]})
        with self.assertRaisesRegex(sv.InputError, "run run, row 3: time is 0.1"):
            sv.Log.from_pandas(table)
        with self.assertRaisesRegex(sv.InputError, "found no column 'phi' for angle"):
            sv.Log.from_pandas(table, columns={"angle": "phi"})
        with self.assertRaisesRegex(sv.InputError, "torque"):
            sv.Log.from_pandas(table, units={"torque": "lbf"})
        table["time"] = [0.0, 0.1, 0.2]
        log = sv.Log.from_pandas(table)
        for options, expected in [
            ({"exclude": ["none"]}, "found no run none"),
            ({"fix": {"friction.x": 1.0}}, "friction.x"),
            ({"hypotheses": ["force += 1"]}, "column 1"),
            ({"tolerance": 1.0}, "from 0 to 0.25"),
            ({"limit": -1.0}, "limit"),
            ({"within": {"anger": "0..1"}}, "expected one of angle"),
        ]:
            with self.subTest(options), self.assertRaisesRegex(sv.InputError, expected):
                sv.diagnose(log, model, **options)
        (self.place / "no.h5").write_bytes(b"nothing")
        with self.assertRaises(OSError):
            sv.Log.read(self.place / "no.h5")

    def test_ctrl_c_ends_it_and_other_threads_go_on(self):
        # A job that a shell started in the background ignores it from birth.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        scenario = sv.Scenario.read(self.scenario({"duration": "20000s"}))
        ticks = []
        done = threading.Event()

        def tick():
            while not done.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.01)

        ticking = threading.Thread(target=tick)
        ticking.start()
        threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        began = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            sv.simulate(scenario)
        done.set()
        ticking.join()
        # Without the interpreter's lock for half a second: tens of ticks; with it held: one or two.
        self.assertGreater(sum(tick > began for tick in ticks), 10)
        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            sv.simulate(scenario, progress=lambda *_: (_ for _ in ()).throw(ZeroDivisionError("mine")))

    def test_the_example_runs(self):
        out = self.place / "example"
        example = REPOSITORY / "crates/python/examples/from_table_to_cause.py"
        finished = subprocess.run([sys.executable, example, out], capture_output=True, text=True, check=False)
        self.assertEqual(finished.returncode, 0, finished.stderr)
        self.assertIn("explained", finished.stdout)
        self.assertTrue((out / "errors.png").read_bytes().startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
