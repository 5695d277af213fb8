"""A stepped rotary hydraulic valve: simulated, held against measured data, and varied by the thousand.

    import stepvalve as sv

    scenario = sv.Scenario.read("rt-config/scenarios/sine-1hz.toml")
    run = sv.simulate(scenario)                      # closed loop, faster than real time
    run.to_pandas().plot(x="time", y=["reference_angle", "true_angle"])

    log = sv.Log.from_pandas(table, run="test", units={"angle": "deg"})
    found = sv.diagnose(log, sv.Model.read("valve.toml"))
    print(found.headline)

Angles are rad, torques N·m, times s, pressures Pa, flows m³/s, oil temperatures °C. What is computed is computed by the same code as the
`stepvalve` command's, without the interpreter's lock; Ctrl-C ends it. What is wrong with an input raises `InputError`.
"""
from ._campaign import Campaign, TooManyFailures
from ._diagnosis import Diagnosis, diagnose
from ._log import Log, predict
from ._model import Model
from ._scenario import Run, Scenario, simulate
from ._stepvalve import VERSION as __version__
from ._stepvalve import InputError

__all__ = [
    "Campaign",
    "Diagnosis",
    "InputError",
    "Log",
    "Model",
    "Run",
    "Scenario",
    "TooManyFailures",
    "__version__",
    "diagnose",
    "predict",
    "simulate",
]
