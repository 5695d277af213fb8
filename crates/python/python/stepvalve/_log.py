"""Measured runs: from pandas, from files, and what a model has for them."""
from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import pandas as pd

from . import _stepvalve as native
from ._model import Model
from ._progress import Progress, told

if TYPE_CHECKING:
    from numpy.typing import NDArray

CHANNELS = {
    "time": "s",
    "angle": "rad",
    "angle_command": "rad",
    "torque": "N*m",
    "pressure_drop": "Pa",
    "flow": "m^3/s",
    "oil_temperature": "degC",
}
"""What models know, and the units that logs hold it in. Any other column is kept, and used by nobody."""


@dataclasses.dataclass
class LogRun:
    """One run: columns of one length, in the units of `CHANNELS`; NaN is what was not measured."""

    name: str
    kind: str
    columns: dict[str, NDArray[np.float64]]
    units: dict[str, str] = dataclasses.field(default_factory=dict)

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        return self.columns[column]

    def to_pandas(self) -> pd.DataFrame:
        """The columns as a table."""
        return pd.DataFrame(self.columns)


class Log:
    """Measured runs on one clock: a list of `LogRun`, which all have `time` and `angle`.

    With `torque` a model predicts the torque from the motion; with `angle_command` and no torque, or a model with a motor, the angle from
    the command.
    """

    def __init__(self, runs: list[LogRun], title: str = "", angle_zero: str = "common", name: str = "log") -> None:
        """`angle_zero`: "per-run" where the angle of each run has a zero of its own. Raises InputError naming run and row."""
        self._native = native.Log(name, title, angle_zero, [_native_run(run) for run in runs])
        self.runs = runs
        """The runs, in their order."""

    @classmethod
    def from_pandas(
        cls,
        table: pd.DataFrame | Mapping[str, pd.DataFrame],
        run: str | None = None,
        columns: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        title: str = "",
        angle_zero: str = "common",
        name: str = "table",
    ) -> Log:
        """From a table, or a table for each run by its name.

        `run`: the column that tells runs apart. `columns`: what the channels are called in the table, {"angle": "Position"}. `units`: the
        units of channels that are not in those of `CHANNELS`, {"angle": "deg", "pressure_drop": "bar"}.
        """
        tables = dict(table) if isinstance(table, Mapping) else _by_run(table, run)
        named = {ours: theirs for ours, theirs in (columns or {}).items()}
        factors = {channel: native.to_si(channel, unit) for channel, unit in (units or {}).items()}
        runs = [_run_of(str(key), rows, named, factors, run) for key, rows in tables.items()]
        return cls(runs, title=title, angle_zero=angle_zero, name=name)

    @classmethod
    def read(cls, path: str | pathlib.Path) -> Log:
        """From a valve-log (HDF5), such as run.h5 or what `stepvalve import` makes of a table. h5py reads it."""
        with h5py.File(path, "r") as file:
            if _text(file.attrs.get("format")) != "valve-log" or "runs" not in file:
                raise native.InputError(f"{path}: found no valve-log, expected what stepvalve import makes of a table")
            runs = [_run_in(f"{path}", name, group) for name, group in file["runs"].items() if isinstance(group, h5py.Group)]
            title = _text(file.attrs.get("title"))
            angle_zero = _text(file.attrs.get("angle_zero")) or "common"
        return cls(runs, title=title, angle_zero=angle_zero, name=str(path))

    def write(self, path: str | pathlib.Path) -> None:
        """To a valve-log that `stepvalve diagnose` and MATLAB read. Raises FileExistsError where the file exists."""
        with h5py.File(path, "x") as file:
            file.attrs["format"] = "valve-log"
            file.attrs["format_version"] = 1
            file.attrs["title"] = self.title
            file.attrs["angle_zero"] = self.angle_zero
            for run in self.runs:
                group = file.create_group(f"runs/{run.name}")
                group.attrs["kind"] = run.kind
                for column, values in run.columns.items():
                    group.create_dataset(column, data=values).attrs["unit"] = CHANNELS.get(column, run.units.get(column, "1"))

    @classmethod
    def _of(cls, of: native.Log) -> Log:
        log = cls.__new__(cls)
        log._native = of
        log.runs = [
            LogRun(name, kind, {column: values for column, _, values in columns}, {column: unit for column, unit, _ in columns})
            for name, kind, columns in of.runs()
        ]
        return log

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return self._native.title

    @property
    def angle_zero(self) -> str:
        """"common" or "per-run"."""
        return self._native.angle_zero

    @property
    def name(self) -> str:
        """As files that are made of it name it."""
        return self._native.name

    def __getitem__(self, name: str) -> LogRun:
        for run in self.runs:
            if run.name == name:
                return run
        raise KeyError(f"found no run {name!r}, expected one of {', '.join(run.name for run in self.runs)}")

    def __iter__(self) -> Iterator[LogRun]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def to_pandas(self) -> pd.DataFrame:
        """All runs one under the other, with a column `run`."""
        tables = [run.to_pandas().assign(run=run.name) for run in self.runs]
        return pd.concat(tables, ignore_index=True)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Log, (self.runs, self.title, self.angle_zero, self.name))

    def __repr__(self) -> str:
        samples = sum(len(run["time"]) for run in self.runs)
        return f"<Log {self.title!r}: {len(self.runs)} runs, {samples} samples>"


def predict(log: Log, model: Model, progress: bool | Progress | None = None) -> Log:
    """The same runs with what the model has for them in the place of what was measured: `torque`, or else `angle`.

    What `stepvalve predict` writes, bit for bit. NaN is where nothing can be predicted.
    """
    with told(progress) as tell:
        predicted = native.predict(log._native, model._native, tell)
    runs = [
        dataclasses.replace(run, columns={**run.columns, channel: values})
        for run, (channel, values) in zip(log.runs, predicted, strict=True)
    ]
    return Log(runs, title=f"Prediction: {log.title}", angle_zero=log.angle_zero, name=log.name)


def _native_run(run: LogRun) -> native.NativeRun:
    known = [(name, _floats(run.columns[name])) for name in CHANNELS if name in run.columns]
    extra = [(name, run.units.get(name, "1"), _floats(values)) for name, values in run.columns.items() if name not in CHANNELS]
    return (run.name, run.kind, known, extra)


def _floats(values: Any) -> NDArray[np.float64]:
    return np.ascontiguousarray(values, dtype=np.float64)


def _by_run(table: pd.DataFrame, run: str | None) -> dict[str, pd.DataFrame]:
    if run is None:
        return {"run": table}
    if run not in table:
        raise native.InputError(f"found no column {run!r}, expected one of {', '.join(map(str, table.columns))}")
    return {str(key): rows for key, rows in table.groupby(run, sort=False)}


def _run_of(
    key: str, table: pd.DataFrame, named: Mapping[str, str], factors: Mapping[str, float], run: str | None
) -> LogRun:
    for needed in ("time", "angle"):
        theirs = named.get(needed, needed)
        if theirs not in table:
            found = ", ".join(map(str, table.columns))
            raise native.InputError(f"run {key}: found no column {theirs!r} for {needed} (there are {found}); columns={{...}} says which it is")
    taken = {channel: named.get(channel, channel) for channel in CHANNELS if named.get(channel, channel) in table}
    rest = [column for column in table if column not in taken.values() and column != run]
    values = {channel: _floats(table[theirs]) * factors.get(channel, 1.0) for channel, theirs in taken.items()}
    numbers = [column for column in rest if pd.api.types.is_numeric_dtype(table[column])]
    values |= {str(column): _floats(table[column]) for column in numbers}
    return LogRun(key, "", values)


def _run_in(file: str, name: str, group: h5py.Group) -> LogRun:
    columns: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    rows = group["time"].shape if "time" in group else None
    for column, dataset in group.items():
        if not isinstance(dataset, h5py.Dataset) or dataset.dtype.kind not in "fiu" or dataset.shape != rows:
            continue
        unit = _text(dataset.attrs.get("unit"))
        if column in CHANNELS and unit != CHANNELS[column]:
            raise native.InputError(f"{file}: /runs/{name}/{column}: found the unit {unit!r}, expected {CHANNELS[column]!r}")
        columns[column], units[column] = dataset[()].astype(np.float64), unit or "1"
    return LogRun(name, _text(group.attrs.get("kind")), columns, units)


def _text(value: Any) -> str:
    if value is None:
        return ""
    return value.decode() if isinstance(value, bytes) else str(value)
