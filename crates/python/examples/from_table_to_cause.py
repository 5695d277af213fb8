#!/usr/bin/env python3
"""From a table of pandas to a named cause and a plot, cell by cell as in a notebook.

    python from_table_to_cause.py [FOLDER]      the plot goes to FOLDER/errors.png, the extended model beside it

The table is the example of the README: sixteen records of a rig whose friction grows with pressure, which the model does not know.
"""
# %% The records, as an instrument wrote them: a preamble, names, units, then numbers
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import pandas as pd

import stepvalve as sv

repository = pathlib.Path(__file__).resolve().parents[3]
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "found")
out.mkdir(parents=True, exist_ok=True)

records = sorted((repository / "rt-config/examples/pressure-rig").glob("run-*.csv"))
tables = {path.stem: pd.read_csv(path, sep=";", skiprows=[0, 1, 2, 4]) for path in records}

# %% One clock for all: each record begins a minute after the one before
begins_ms = 0.0
for table in tables.values():
    table["Time"] += begins_ms
    table["Torque"] /= 100.0  # N·cm
    begins_ms = table["Time"].iloc[-1] + 60_000.0

log = sv.Log.from_pandas(
    tables,
    columns={"time": "Time", "angle": "Angle", "torque": "Torque", "pressure_drop": "Pressure"},
    units={"time": "ms", "angle": "deg", "pressure_drop": "bar"},
    title="pressure rig",
)
print(log)

# %% What the model gets wrong, and why
model = sv.Model.read(repository / "rt-config/models/rig.toml")
found = sv.diagnose(log, model, limit=None, progress=True)
print(f"{found.verdict}: {found.headline}")
print(found.parameters.to_string(index=False))

# %% Measured less predicted, before and after, by pressure
predicted = found.predicted
pressure = pd.concat([pd.Series(run["pressure_drop"]) for run in log], ignore_index=True) / 1e5
figure, axes = plt.subplots(1, 2, sharey=True, figsize=(9, 3.5), layout="constrained")
for axis, of, title in zip(axes, ["before", "after"], ["model as given", "model extended"], strict=True):
    axis.plot(pressure, predicted["measured"] - predicted[of], ".", markersize=2, alpha=0.4)
    axis.set(title=title, xlabel="pressure drop, bar")
axes[0].set_ylabel("torque, measured less predicted, N·m")
figure.savefig(out / "errors.png", dpi=120)

# %% The model that knows it, for the controller and the simulator
found.model.write(out / "rig-extended.toml")
print(f"{out / 'errors.png'}, {out / 'rig-extended.toml'}")
