#!/usr/bin/env python3
"""A campaign in shards on any executor of concurrent.futures: threads of this machine, or a cluster's.

    tools/campaign_shards.py PLAN.toml --out DIR [--shards N] [--dask SCHEDULER:PORT]

Each shard is `stepvalve campaign PLAN.toml --shard I/N --resume` in DIR/shards/I; at the end `stepvalve campaign merge` makes one table
of them in DIR/whole. A shard whose worker dies is sent out again and goes on behind its last row, so nothing is lost and nothing made
twice. All machines must see PLAN.toml and DIR under the same path.
"""
import argparse
import concurrent.futures
import pathlib
import subprocess
import sys
import time

INTERRUPTED = 130
ATTEMPTS = 5
LOCKED = "another campaign writes to it"


def run_shard(plan, folder, part, parts):
    """One shard, with one job; its exit code and what it complained of."""
    command = ["stepvalve", "campaign", plan, "--out", folder, "--shard", f"{part}/{parts}", "--resume", "--jobs", "1"]
    while True:
        finished = subprocess.run(command, capture_output=True, text=True, check=False)
        # The program of a worker that died goes on by itself: what it makes is wanted.
        if LOCKED not in finished.stderr:
            return finished.returncode, finished.stderr
        time.sleep(1)


def run(plan, out, parts, executor):
    """All shards and the merged table in out/whole. `executor` is any of concurrent.futures, or a dask client's get_executor()."""
    plan, out = pathlib.Path(plan).resolve(), pathlib.Path(out).resolve()
    folders = {part: str(out / "shards" / str(part)) for part in range(1, parts + 1)}
    open_parts = list(folders)
    for _ in range(ATTEMPTS):
        futures = {executor.submit(run_shard, str(plan), folders[part], part, parts): part for part in open_parts}
        open_parts = []
        for future in concurrent.futures.as_completed(futures):
            part = futures[future]
            code, complaint = (INTERRUPTED, str(future.exception())) if future.exception() else future.result()
            if code == 0:
                continue
            print(f"shard {part}/{parts}: exit code {code}: {complaint.strip()}", file=sys.stderr)
            if code in (1, 2):
                raise SystemExit(code)
            open_parts.append(part)
        if not open_parts:
            merge = ["stepvalve", "campaign", "merge", *folders.values(), "--out", str(out / "whole")]
            return subprocess.run(merge, check=False).returncode
    print(f"shards {open_parts} did not end in {ATTEMPTS} attempts; the same command goes on", file=sys.stderr)
    return 1


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan")
    parser.add_argument("--out", required=True)
    parser.add_argument("--shards", type=int, default=16)
    parser.add_argument("--dask", metavar="SCHEDULER:PORT")
    options = parser.parse_args()
    if options.dask:
        import distributed

        with distributed.Client(options.dask) as client:
            return run(options.plan, options.out, options.shards, client.get_executor(pure=False))
    with concurrent.futures.ThreadPoolExecutor() as executor:
        return run(options.plan, options.out, options.shards, executor)


if __name__ == "__main__":
    sys.exit(main())
