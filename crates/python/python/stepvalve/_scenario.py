"""Scenarios, and their runs in closed loop."""
from __future__ import annotations

import pathlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from . import _stepvalve as native
from ._model import Model
from ._progress import Progress, told

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._log import Log


class Scenario:
    """A run to be made: timing, driver, encoder, limits, set-points (docs/scenario.md), with the models of plant and controller.

    It never changes: `with_values` and `with_models` make another.
    """

    def __init__(self, text: str, truth: Model, belief: Model, file: str = "scenario.toml") -> None:
        """From text and models: `truth` is the simulated plant, `belief` what the controller knows."""
        self._native = native.Scenario(text, file, truth._native, belief._native)

    @classmethod
    def read(cls, path: str | pathlib.Path) -> Scenario:
        """From a file, with the models that it names."""
        path = pathlib.Path(path)
        text = path.read_text(encoding="utf-8")
        truth, belief = native.Scenario.models_of(text, str(path))
        return cls(text, Model.read(path.parent / truth), Model.read(path.parent / belief), str(path))

    @classmethod
    def _of(cls, of: native.Scenario) -> Scenario:
        scenario = cls.__new__(cls)
        scenario._native = of
        return scenario

    @property
    def name(self) -> str:
        """What the scenario calls itself."""
        return self._native.name

    @property
    def file(self) -> str:
        """Where it came from."""
        return self._native.file

    @property
    def text(self) -> str:
        """The TOML text."""
        return self._native.text

    @property
    def truth(self) -> Model:
        """The simulated plant."""
        return Model._of(self._native.truth)

    @property
    def belief(self) -> Model:
        """What the controller knows of it."""
        return Model._of(self._native.belief)

    @property
    def period_s(self) -> float:
        """The cycle, s."""
        return self._native.period_s

    @property
    def duration_s(self) -> float:
        """How long it goes on, s."""
        return self._native.duration_s

    @property
    def warnings(self) -> list[str]:
        """What is allowed but may surprise."""
        return self._native.warnings()

    def __getitem__(self, path: str) -> float | bool | str:
        """The value at a path such as `encoder.counts_per_turn` or `set_point[0].angle`."""
        return self._native.get(path)

    def with_values(self, changes: dict[str, Any]) -> Scenario:
        """Another scenario with values changed by their paths: numbers, or texts with a unit such as "17deg"."""
        return Scenario._of(self._native.changed(list(changes.items())))

    def with_models(self, truth: Model | None = None, belief: Model | None = None) -> Scenario:
        """Another scenario of other models."""
        truth, belief = truth or self.truth, belief or self.belief
        return Scenario._of(self._native.with_models(truth._native, belief._native))

    def __reduce__(self) -> tuple[Any, ...]:
        return (Scenario, (self.text, self.truth, self.belief, self.file))

    def __repr__(self) -> str:
        return f"<Scenario {self.name!r}, {self.duration_s:g} s at {self.period_s * 1e3:g} ms>"


class Run:
    """What became of a scenario: a row a cycle, with the columns of run.h5.

    `run["true_angle"]` is an array, `run.units["true_angle"]` its unit; NaN is what no message said.
    """

    def __init__(
        self, title: str, columns: list[tuple[str, str, NDArray[np.float64]]], metrics: dict[str, Any]
    ) -> None:
        self.title = title
        self.units: dict[str, str] = {name: unit for name, unit, _ in columns}
        """The unit of each column; "1" for counts, codes and flags."""
        self._columns = {name: values for name, _, values in columns}
        self.metrics = metrics
        """following_error_rms and _peak (rad), final_error (rad), torque_reserve_min (N·m), pulse_rate_peak (Hz), lost_steps, fault, ..."""

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        return self._columns[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns["time"])

    @property
    def columns(self) -> list[str]:
        """The names of the columns."""
        return list(self._columns)

    def to_pandas(self) -> pd.DataFrame:
        """All columns; the units are in `.attrs["units"]`."""
        frame = pd.DataFrame(self._columns)
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_log(self) -> Log:
        """The run as a log, for `predict` and `diagnose`."""
        from ._log import Log, LogRun

        run = LogRun("closed-loop", "closed-loop", dict(self._columns), dict(self.units))
        return Log([run], title=self.title)

    def __repr__(self) -> str:
        return f"<Run of {self.title!r}: {len(self)} cycles, {len(self._columns)} columns>"


def simulate(scenario: Scenario, progress: bool | Progress | None = None) -> Run:
    """Runs a scenario in closed loop to its end, in this process and as fast as it goes.

    The columns are those that `stepvalve simulate` writes to run.h5, bit for bit. `progress`: True for a bar, or a function that is
    called as `progress(what, part)`.
    """
    with told(progress) as tell:
        columns, metrics = native.simulate(scenario._native, tell)
    return Run(scenario.name, columns, metrics)
