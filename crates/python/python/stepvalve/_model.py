"""Models: what friction, load, motor and orifice of a valve are."""
from __future__ import annotations

import pathlib
from typing import Any

from . import _stepvalve as native


class Model:
    """A model of the valve, as its TOML text has it (docs/model.md). It never changes: `with_values` makes another.

    >>> model = Model.read("rt-config/models/rig.toml")
    >>> stiffer = model.with_values({"friction.coulomb_torque_nm": 1.4})
    """

    def __init__(self, text: str, file: str = "model.toml") -> None:
        """From text; `file` is what errors call it. Raises InputError with line and column of everything that is wrong."""
        self._native = native.Model(text, file)

    @classmethod
    def read(cls, path: str | pathlib.Path) -> Model:
        """From a file."""
        return cls(pathlib.Path(path).read_text(encoding="utf-8"), str(path))

    @classmethod
    def _of(cls, of: native.Model) -> Model:
        model = cls.__new__(cls)
        model._native = of
        return model

    @property
    def name(self) -> str:
        """What the model calls itself."""
        return self._native.name

    @property
    def file(self) -> str:
        """Where it came from, as errors and files made of it name it."""
        return self._native.file

    @property
    def text(self) -> str:
        """The TOML text."""
        return self._native.text

    @property
    def paths(self) -> list[str]:
        """The paths of all values: `friction.coulomb_torque_nm`, `effect[0].gain`, ..."""
        return self._native.paths()

    def __getitem__(self, path: str) -> float | bool | str:
        """The value at a path; a number in the unit of its key, a text such as "17deg" where the file has one."""
        return self._native.get(path)

    def with_values(self, changes: dict[str, Any]) -> Model:
        """Another model with values changed by their paths. Comments and everything else stay."""
        return Model._of(self._native.changed(list(changes.items())))

    def write(self, path: str | pathlib.Path) -> None:
        """Writes the text to a file; what is there is replaced."""
        pathlib.Path(path).write_text(self.text, encoding="utf-8")

    def __reduce__(self) -> tuple[Any, ...]:
        return (Model, (self.text, self.file))

    def __repr__(self) -> str:
        return f"<Model {self.name!r}>"

    def __str__(self) -> str:
        return self.text
