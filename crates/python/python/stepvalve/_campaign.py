"""Thousands of runs: a plan, on this machine or on any executor of concurrent.futures."""
from __future__ import annotations

import concurrent.futures
import functools
import pathlib
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import pandas as pd

from . import _stepvalve as native
from ._model import Model
from ._progress import Progress, told
from ._scenario import Scenario

ATTEMPTS = 5
# Progress, and what a kill may cost, go by chunks; at the end of each a core may wait for the other.
CHUNKS = 64
SMALLEST_CHUNK = 32

_Texts = tuple[str, str]
_Base = tuple[_Texts, _Texts, _Texts]


class TooManyFailures(RuntimeError):
    """More runs failed than the plan's failure_limit allows; `table` has what was made."""

    def __init__(self, message: str, table: pd.DataFrame) -> None:
        super().__init__(message)
        self.table = table


class Campaign:
    """A plan (docs/campaign.md): scenarios, what is varied in them, and how. It carries its texts, so that workers need no files."""

    def __init__(self, plan: _Texts, bases: list[_Base]) -> None:
        """From texts, each with the file's name before it; `read` is what you want."""
        self._given = (plan, bases)
        self._native = native.Campaign(plan, bases, _build())

    @classmethod
    def read(cls, path: str | pathlib.Path) -> Campaign:
        """From a file, with the scenarios and models that it names."""
        path = pathlib.Path(path)
        text = path.read_text(encoding="utf-8")
        bases = [_base(path.parent / file, file) for file in native.plan_scenarios(text, str(path))]
        return cls((str(path), text), bases)

    @property
    def name(self) -> str:
        """What the plan calls itself."""
        return self._native.name

    @property
    def warnings(self) -> list[str]:
        """What is allowed but may surprise."""
        return self._native.warnings()

    def __len__(self) -> int:
        """How many runs there are."""
        return self._native.runs

    def scenario(self, run: int) -> Scenario:
        """The scenario of a run, with what is varied: `simulate` it to look into it."""
        scenario, truth, belief = self._native.texts(run)
        of = f"run {run} of {self.name}"
        return Scenario(scenario, Model(truth, f"truth of {of}"), Model(belief, f"belief of {of}"), of)

    def run(
        self,
        executor: concurrent.futures.Executor | None = None,
        *,
        jobs: int | None = None,
        keep: str | pathlib.Path | None = None,
        chunk: int | None = None,
        progress: bool | Progress | None = None,
    ) -> pd.DataFrame:
        """Makes all runs; a table of a row a run, in the order of the runs, as campaign.h5 has it. Units are in `.attrs["units"]`.

        - `executor`: any of concurrent.futures, or a dask client's `get_executor()`: chunks of runs go to its workers, which need this
          package. A chunk whose worker died is sent out again, five times at most. Without, all cores of this machine make them
        - `jobs`: how many at a time: here, or within a worker (one there without)
        - `keep`: a file that rows go to as they come; the same call goes on from it, and another plan, or another build of
          this package, is refused
        - `chunk`: how many runs an executor's task has, and how many `keep` gets at once
        - `progress`: True for a bar, or a function that is called as `progress(what, part)`
        """
        rows = _Rows(self._native, pathlib.Path(keep) if keep else None)
        missing = sorted(set(range(len(self))) - rows.runs)
        smallest = SMALLEST_CHUNK if executor is None else 1
        chunks = list(_chunks(missing, chunk or max(smallest, len(self) // CHUNKS)))
        with told(progress) as tell:

            def further(of: int, part: float | None) -> None:
                if tell:
                    tell("simulating runs", (len(rows.runs) + of * (part or 0.0)) / len(self))

            made = self._here(chunks, jobs, further) if executor is None else self._there(executor, chunks, jobs or 1)
            for some in made:
                rows.add(some)
                further(0, None)
                if rows.failed > self._native.failures_allowed:
                    break
        table = self._table(rows.bytes)
        if rows.failed > self._native.failures_allowed:
            allowed = self._native.failures_allowed
            raise TooManyFailures(f"found {rows.failed} runs that failed, expected at most {allowed} (failure_limit)", table)
        return table

    def _here(
        self, chunks: list[list[int]], jobs: int | None, further: Callable[[int, float | None], None]
    ) -> Iterator[list[bytes]]:
        for chunk in chunks:
            tell = functools.partial(_further, further, len(chunk))
            yield self._native.make(chunk, jobs, tell)

    def _there(self, executor: concurrent.futures.Executor, chunks: list[list[int]], jobs: int) -> Iterator[list[bytes]]:
        failure: BaseException | None = None
        for _ in range(ATTEMPTS):
            futures = {executor.submit(_make, self, chunk, jobs): chunk for chunk in chunks}
            chunks = []
            try:
                for future in concurrent.futures.as_completed(futures):
                    failed = future.exception()
                    if failed is None:
                        build, rows = future.result()
                        if build != _build():
                            raise native.InputError(f"a worker has build {build} of this package, expected {_build()}: another computes other numbers")
                        yield rows
                    else:
                        failure = failed
                        chunks.append(futures[future])
            finally:
                # Whoever stopped listening wants no more of them.
                for future in futures:
                    future.cancel()
            if not chunks:
                return
        raise RuntimeError(f"{len(chunks)} chunks of runs did not end in {ATTEMPTS} attempts; the last said: {failure}") from failure

    def _table(self, rows: bytes) -> pd.DataFrame:
        columns = self._native.columns(rows)
        table = pd.DataFrame({name: values for name, _, values in columns})
        table.attrs["units"] = {name: unit for name, unit, _ in columns}
        return table

    def __reduce__(self) -> tuple[Any, ...]:
        return (Campaign, self._given)

    def __repr__(self) -> str:
        return f"<Campaign {self.name!r}: {len(self)} runs>"


class _Rows:
    """Rows as they come: in memory, and in a file that is gone on with."""

    def __init__(self, campaign: native.Campaign, path: pathlib.Path | None) -> None:
        self._campaign = campaign
        self._path = path
        self._head = campaign.head()
        there = path is not None and path.exists() and path.stat().st_size > 0
        self.bytes = path.read_bytes() if path is not None and there else self._head
        if path is not None and not there:
            path.write_bytes(self.bytes)
        held, self.failed = campaign.held(self.bytes)
        self.runs = set(held)

    def add(self, rows: list[bytes]) -> None:
        some = b"".join(rows)
        if self._path is not None:
            with self._path.open("ab") as file:
                file.write(some)
        self.bytes += some
        held, failed = self._campaign.held(self._head + some)
        self.runs.update(held)
        self.failed += failed


def _further(further: Callable[[int, float | None], None], of: int, _: str, part: float | None) -> None:
    """Progress within a chunk of so many runs."""
    further(of, part)


def _make(campaign: Campaign, runs: list[int], jobs: int) -> tuple[str, list[bytes]]:
    """What a worker does."""
    return _build(), campaign._native.make(runs, jobs, None)


@functools.cache
def _build() -> str:
    """Which build of the native part this is: two of one version may compute other numbers."""
    return f"{zlib.crc32(pathlib.Path(native.__file__).read_bytes()):08x}"


def _chunks(runs: list[int], size: int) -> Iterator[list[int]]:
    for begin in range(0, len(runs), size):
        yield runs[begin : begin + size]


def _base(path: pathlib.Path, named: str) -> _Base:
    text = path.read_text(encoding="utf-8")
    truth, belief = native.Scenario.models_of(text, str(path))
    read = [(file, (path.parent / file).read_text(encoding="utf-8")) for file in (truth, belief)]
    return ((named, text), read[0], read[1])
