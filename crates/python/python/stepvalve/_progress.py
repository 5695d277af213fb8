"""How long work tells of itself: to a function, on a bar, or not at all."""
from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

Progress = Callable[[str, float | None], object]
"""Called as `progress(what, part)`: what is being done, and how much of it from 0 to 1, or None."""


@contextlib.contextmanager
def told(progress: bool | Progress | None) -> Iterator[Progress | None]:
    """What the native part calls. True: a bar of tqdm where it is installed, in notebooks too; else lines on stderr."""
    if progress is None or progress is False:
        yield None
    elif progress is not True:
        yield progress
    else:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            yield _Lines()
            return
        with tqdm(total=1.0, bar_format="{desc} {percentage:3.0f} %|{bar}| {elapsed}") as bar:

            def show(what: str, part: float | None) -> None:
                bar.set_description_str(what)
                if part is not None:
                    bar.n = part
                bar.refresh()

            yield show


class _Lines:
    """A line for each step, and for each tenth of it."""

    def __init__(self) -> None:
        self.last = ""

    def __call__(self, what: str, part: float | None) -> None:
        line = what if part is None else f"{what}: {int(part * 10) * 10} %"
        if line != self.last:
            self.last = line
            print(line, file=sys.stderr)
