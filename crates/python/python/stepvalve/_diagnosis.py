"""What the model gets wrong, why, and what that is worth."""
from __future__ import annotations

import functools
import json
import pathlib
from typing import Any

import pandas as pd

from . import _stepvalve as native
from ._log import Log
from ._model import Model
from ._progress import Progress, told
from ._scenario import Scenario

class Diagnosis:
    """The answer: `verdict`, `headline`, `causes`, the extended `model`, and everything of diagnosis.json in `details`."""

    def __init__(self, of: native.Diagnosis, given: Model) -> None:
        self._native = of
        self._given = given

    @property
    def headline(self) -> str:
        """The answer in a sentence or two."""
        return self._native.headline()

    @property
    def json(self) -> str:
        """diagnosis.json, as the command writes it."""
        return self._native.json()

    @functools.cached_property
    def details(self) -> dict[str, Any]:
        """diagnosis.json as a dict; docs/diagnosis.md explains its fields."""
        details: dict[str, Any] = json.loads(self.json)
        return details

    @property
    def verdict(self) -> str:
        """"no-discrepancy", "explained", "ambiguous" or "unexplained"."""
        return str(self.details["verdict"])

    @property
    def causes(self) -> list[str]:
        """The causes that were accepted, the most important first: docs/effects.md has their names."""
        return [cause["id"] for cause in self.details["causes"]]

    @property
    def ambiguous(self) -> list[list[str]]:
        """Groups of causes that these data can't tell apart."""
        return [group["ids"] for group in self.details["ambiguous"]]

    @property
    def parameters(self) -> pd.DataFrame:
        """Every number of the causes: cause, parameter, value, unit and 95 % interval."""
        rows = [
            {
                "cause": cause["id"],
                "parameter": key,
                "value": found["value"],
                "unit": found["unit"],
                "low95": found["ci95"][0],
                "high95": found["ci95"][1],
            }
            for cause in self.details["causes"]
            for key, found in cause["parameters"].items()
        ]
        return pd.DataFrame(rows, columns=["cause", "parameter", "value", "unit", "low95", "high95"])

    @property
    def gain(self) -> float:
        """The error on runs that nothing was fitted on, with what was found over that without: 0.3 is a third of it."""
        return float(self.details["gain"]["ratio"])

    @property
    def next_experiment(self) -> str:
        """What to measure next."""
        return str(self.details["next_experiment"])

    @property
    def experiment_files(self) -> dict[str, str]:
        """The next experiment's files by their names, where one would decide."""
        return dict(self._native.experiment())

    @functools.cached_property
    def model(self) -> Model:
        """The given model with what was found in it: model-extended.toml."""
        return Model(self._native.extended_text(), "model-extended.toml")

    @functools.cached_property
    def rivals(self) -> dict[str, Model]:
        """A model for each cause of the groups that can't be told apart."""
        return {file.removeprefix("model-").removesuffix(".toml"): Model(text, file) for file, text in self._native.rivals()}

    @functools.cached_property
    def predicted(self) -> pd.DataFrame:
        """Every sample beside what the models have for it.

        Columns: run, time (s), measured, before (the given model), after (the extended one), deviation (the standard deviation of measured
        less after, were the extended model right). `.attrs["channel"]` says what is predicted: "torque" in N·m, or "angle" in rad.
        """
        channel, runs = self._native.predictions()
        log = {run.name: run for run in Log._of(self._native.log())}
        tables = [
            pd.DataFrame(
                {
                    "run": name,
                    "time": log[name]["time"],
                    "measured": log[name][channel],
                    "before": before,
                    "after": after,
                    "deviation": deviation,
                }
            )
            for name, (before, after, deviation) in runs
        ]
        table = pd.concat(tables, ignore_index=True)
        table.attrs["channel"] = channel
        return table

    def write(self, folder: str | pathlib.Path) -> None:
        """diagnosis.json, model-extended.toml and the next experiment, into a folder. What is there is replaced."""
        folder = pathlib.Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        files = {"diagnosis.json": self.json, "model-extended.toml": self.model.text, **self.experiment_files}
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")

    def __repr__(self) -> str:
        return f"<Diagnosis {self.verdict}: {', '.join(self.causes) or 'no cause'}>"

    def __str__(self) -> str:
        return self.headline


def diagnose(
    log: Log,
    model: Model,
    *,
    exclude: list[str] | None = None,
    fix: dict[str, float] | None = None,
    hypotheses: list[str] | None = None,
    effects: str | pathlib.Path | None = None,
    seed: int = 0,
    noise: float | None = None,
    tolerance: float = 0.03,
    limit: float | None = 80.0,
    scenario: Scenario | None = None,
    within: dict[str, str] | None = None,
    experiment_time: float = 60.0,
    progress: bool | Progress | None = None,
) -> Diagnosis:
    """Holds measured runs against a model: what it gets wrong, why, and what that is worth.

    The same answer as `stepvalve diagnose`, bit for bit.

    - `exclude`: runs to leave out
    - `fix`: numbers of the model that are known exactly, {"load.inertia_kg_m2": 0.008}: they are no cause
    - `hypotheses`: laws that you suspect, ["torque += a*speed*abs(speed)"]; `effects`: a file of such laws
    - `noise`: the measurement's RMS where it is known, N·m or rad; else it is estimated
    - `tolerance`: how well the model's numbers are known, as a standard deviation in parts of each
    - `limit`: the longest that it searches, s; None for as long as it takes
    - `scenario`, `within`, `experiment_time` (s): what the next experiment must keep to, within={"pressure_drop": "0MPa..16MPa"}
    - `progress`: True for a bar, or a function that is called as `progress(what, part)`
    """
    laws = None if effects is None else (str(effects), pathlib.Path(effects).read_text(encoding="utf-8"))
    asked: native.Asked = {
        "exclude": exclude or [],
        "fix": [f"{path}={value!r}" for path, value in (fix or {}).items()],
        "hypotheses": hypotheses or [],
        "effects": laws,
        "seed": seed,
        "noise": noise,
        "tolerance": tolerance,
        "limit_s": limit,
        "within": [f"{what}={reach}" for what, reach in (within or {}).items()],
        "experiment_s": experiment_time,
    }
    with told(progress) as tell:
        of = native.diagnose(log._native, model._native, asked, scenario._native if scenario else None, tell)
    return Diagnosis(of, model)
