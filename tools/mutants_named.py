"""Makes the changes of tools/mutants.named one at a time, and runs the tests of the crate that was changed.

Exit code 1 if a change was noticed by no test, 2 if one is not found where it should be. Every file is put back.
"""

import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def changes():
    """Crate, file, text found and its replacement, of every line."""
    for line in (ROOT / "tools/mutants.named").read_text().splitlines():
        if line and not line.startswith("#"):
            yield [part.strip().replace("\\|", "|") for part in line.split(" | ")]


def test_names(crate):
    """The crate's own test binaries."""
    return [path.stem for path in sorted((ROOT / "crates" / crate / "tests").glob("*.rs"))]


def noticed(crate):
    """Whether a test of the crate fails, or the change does not compile."""
    command = ["cargo", "test", "--quiet", "--package", crate, "--lib"]
    for name in test_names(crate):
        command += ["--test", name]
    return subprocess.run(command, cwd=ROOT, capture_output=True, timeout=900).returncode != 0


def main():
    missed = 0
    for number, (crate, file, found, instead) in enumerate(changes(), 1):
        path = ROOT / "crates" / crate / "src" / file
        text = path.read_text()
        if text.count(found) != 1:
            print(f"{number}: {path}: found {text.count(found)} times, expected once: {found}")
            return 2
        path.write_text(text.replace(found, instead))
        try:
            seen = noticed(crate)
        finally:
            path.write_text(text)
        missed += not seen
        print(f"{number}: {'noticed' if seen else 'NOT NOTICED'}: {file}: {instead}", flush=True)
    print(f"not noticed: {missed}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
