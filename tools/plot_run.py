#!/usr/bin/env python3
"""Plots a run of the valve: reference and angle, following error, torque, pulse rate.

    python3 -m pip install -r tools/requirements.txt
    python3 tools/plot_run.py run.h5            opens a window
    python3 tools/plot_run.py run.h5 run.png    writes a picture
"""
import sys

try:
    import h5py
    import matplotlib
except ImportError as missing:
    sys.exit(f"found no Python package {missing.name}, expected it: python3 -m pip install -r tools/requirements.txt")

if len(sys.argv) not in (2, 3):
    sys.exit(__doc__)
if len(sys.argv) == 3:
    matplotlib.use("Agg")  # no screen needed
import matplotlib.pyplot as plt

# What each panel shows; a column that the run does not have is left out.
PANELS = [
    ("angle (rad)", ["reference_angle", "angle"]),
    ("following error (rad)", ["following_error"]),
    ("torque (N·m)", ["torque", "friction_torque", "friction_estimate"]),
    ("pulse rate (Hz)", ["pulse_rate"]),
]

RUNNING = 1  # the code of the controller's state in which it follows the reference


def column(run, name):
    """A column; the following error only while the controller follows."""
    values = run[name][:]
    if name == "following_error" and "state" in run:
        values[run["state"][:] != RUNNING] = float("nan")
    return values


with h5py.File(sys.argv[1]) as log:
    run = next(iter(log["runs"].values()))
    time = run["time"][:]
    figure, axes = plt.subplots(len(PANELS), sharex=True, figsize=(10, 10), layout="constrained")
    for axis, (label, names) in zip(axes, PANELS):
        for name in names:
            if name in run:
                axis.plot(time, column(run, name), label=name, linewidth=0.8)
        axis.set_ylabel(label)
        axis.grid(True)
        if axis.lines:
            axis.legend(loc="upper right")
    axes[-1].set_xlabel("time (s)")
    figure.suptitle(log.attrs["title"])

if len(sys.argv) == 3:
    figure.savefig(sys.argv[2], dpi=120)
else:
    plt.show()
