"""Makes the changes of tools/mutants.named one at a time, and runs the tests of the crate that was changed.

Exit code 1 if a change was noticed by no test; 2 if one is not found where it should be or does not compile, or if the tests fail
without any. Every file is put back.
"""

import os
import pathlib
import signal
import subprocess
import sys

# The tests of one of these crates take a few seconds.
LONGEST_S = 300
ROOT = pathlib.Path(__file__).resolve().parent.parent


def changes():
    """Crate, file, text found and its replacement, of every line."""
    for line in (ROOT / "tools/mutants.named").read_text().splitlines():
        if line and not line.startswith("#"):
            yield [part.strip().replace("\\|", "|") for part in line.split(" | ")]


def test_names(crate):
    """The crate's own test binaries."""
    return [path.stem for path in sorted((ROOT / "crates" / crate / "tests").glob("*.rs"))]


def cargo_test(crates, *more):
    """Whether the tests of `crate` or `crate+other`, or with `more` their build, end well. Tests that go on for ever do not."""
    command = ["cargo", "test", "--quiet", "--lib"]
    for crate in crates.split("+"):
        command += ["--package", crate]
        for name in test_names(crate):
            command += ["--test", name]
    process = subprocess.Popen(
        [*command, *more], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        return process.wait(None if more else LONGEST_S) == 0
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return False


def try_one(crate, file, found, instead):
    """What became of one change: `noticed`, `NOT NOTICED`, or why it could not be tried."""
    path = ROOT / "crates" / crate.split("+")[0] / "src" / file
    text = path.read_text()
    if text.count(found) != 1:
        return f"found {text.count(found)} times, expected once: {found}"
    path.write_text(text.replace(found, instead))
    try:
        if not cargo_test(crate, "--no-run"):
            return "does not compile"
        return "NOT NOTICED" if cargo_test(crate) else "noticed"
    finally:
        path.write_text(text)


def main():
    everything = list(changes())
    for crate in sorted({crate for crate, *_ in everything}):
        if not (cargo_test(crate, "--no-run") and cargo_test(crate)):
            print(f"{crate}: its tests fail as it is: nothing can be learned from a change")
            return 2
    said = []
    for number, change in enumerate(everything, 1):
        said.append(try_one(*change))
        _, file, _, instead = change
        print(f"{number}: {said[-1]}: {file}: {instead}", flush=True)
    missed = said.count("NOT NOTICED")
    print(f"not noticed: {missed} of {len(said)}")
    if missed + said.count("noticed") < len(said):
        return 2
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
