#!/usr/bin/env python3
"""Kill a study at random moments, resume it each time, and compare with an undisturbed run.

Each round kills one process with SIGKILL: the client (with its local cluster), a worker, or a
scheduler that runs as its own process. After the last round the same command runs to its end. The
records (without their timing), the series and the report, if there is one, must equal those of the
undisturbed run, and no record may occur twice.

    tools/run python tools/bench/study_kills.py                     ten kills
    tools/run python tools/bench/study_kills.py --kills 3 --seed 7
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

PLAN = """
name: kills
seed: 5
defaults: {trajectory: {kind: hover, hover_time: 1.0}, points: 8000}
conditions:
  - {name: A, title: a box, demonstration: flat, payload: box_68x61x28, view: top}
  - {name: C, title: a triangle, demonstration: formation, payload: hollow_triangle}
flights:
  - {conditions: [A], methods: [task, kopicki], solutions: 2, trials: 12}
  - {conditions: [C], methods: [task, centroid], solutions: 1, trials: 12}
"""
CLI = [sys.executable, "-m", "drake_aerial"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    dice = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder) / "kills.yaml"
        plan.write_text(PLAN)
        calm, stormy = Path(folder) / "calm", Path(folder) / "stormy"
        command = [*CLI, "study", "--plan", str(plan), "--out"]
        began = time.monotonic()
        subprocess.run([*command, str(calm), "--workers", "0"], check=True, capture_output=True)
        wanted = records(calm)
        print(f"undisturbed: {len(wanted)} records in {time.monotonic() - began:.0f} s", flush=True)
        kills = {"client": 0, "worker": 0, "scheduler": 0}
        while sum(kills.values()) < arguments.kills:
            victim = dice.choice(list(kills))
            before = lines(stormy)
            if before >= len(wanted):
                # The study ended before the last kill: restart it.
                shutil.rmtree(stormy)
                before = 0
            local = victim == "client" or (victim == "worker" and dice.random() < 0.5)
            with cluster(arguments.workers, Path(folder)) if not local else NoCluster() as other:
                where = (
                    ["--workers", str(arguments.workers)]
                    if local
                    else ["--scheduler", other.address]
                )
                process = subprocess.Popen(
                    [*command, str(stormy), *where], stderr=subprocess.PIPE, text=True
                )
                # Kill at the start, during the transfer, or in the middle of a later trial.
                await_records(process, stormy, before + max(dice.randint(-2, 6), 0))
                alive(process, dice.uniform(0.0, 3.0))
                if process.poll() is None:
                    kill(victim, process, other, dice)
                    kills[victim] += 1
                # A study survives the loss of its workers, and ends when its scheduler ends.
                if victim == "worker":
                    await_records(process, stormy, lines(stormy) + 2)
                else:
                    alive(process, 60.0)
                if victim == "scheduler" and process.poll() is None:
                    print("the study did not notice that its scheduler has ended")
                    return 1
                process.kill()
                said = (process.communicate()[1].strip().splitlines() or [""])[-1]
                print(
                    f"{victim:9s} ({'local' if local else 'cluster'}): "
                    f"{before} -> {lines(stormy)} records; {said}",
                    flush=True,
                )
        final = subprocess.run(
            [*command, str(stormy), "--workers", str(arguments.workers)],
            check=False,
            capture_output=True,
            text=True,
        )
        print(final.stdout.strip())
        same = {
            "exit code": final.returncode == 0,
            "records": records(stormy) == wanted,
            "none twice": len({record["key"] for record in records(stormy)})
            == lines(stormy)
            == len(wanted),
            "series": contents(stormy / "series", "[!.]*") == contents(calm / "series", "[!.]*"),
            "report": contents(stormy, "report.html") == contents(calm, "report.html"),
        }
        counts = ", ".join(f"{n} {name}" for name, n in kills.items())
        print(f"{sum(kills.values())} kills ({counts}); equal to the undisturbed run:")
        for what, equal in same.items():
            print(f"  {what}: {'yes' if equal else 'NO'}")
        if not same["records"]:
            print(first_difference(wanted, records(stormy)))
        return 0 if all(same.values()) else 1


class NoCluster:
    """The campaign brings its own."""

    address = ""

    def __enter__(self) -> NoCluster:
        return self

    def __exit__(self, *_: object) -> None:
        return


class cluster:
    """A scheduler and workers as processes of their own."""

    def __init__(self, workers: int, folder: Path):
        self._workers, self._folder = workers, folder

    def __enter__(self) -> cluster:
        self.scheduler = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "distributed.cli.dask_scheduler",
                "--port",
                "0",
                "--host",
                "127.0.0.1",
                "--no-dashboard",
            ],
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.scheduler.stderr is not None
        for line in self.scheduler.stderr:
            found = re.search(r"tcp://\S+:\d+", line)
            if found and "Scheduler at" in line:
                self.address = found[0]
                break
        arguments = [
            "--nworkers",
            str(self._workers),
            "--nthreads",
            "1",
            "--no-dashboard",
            "--death-timeout",
            "10",
        ]
        self.staff = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", self.address, *arguments],
            cwd=self._folder,
            stderr=subprocess.DEVNULL,
        )
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*descendants(self.staff.pid), *descendants(self.scheduler.pid)):
            process.kill()
        for own in (self.staff, self.scheduler):
            own.kill()
            own.wait()


def kill(victim: str, process: subprocess.Popen[str], other: object, dice: random.Random) -> None:
    """Kill one process of a campaign."""
    if victim == "client":
        os.kill(process.pid, signal.SIGKILL)
    elif victim == "scheduler":
        assert isinstance(other, cluster)
        os.kill(other.scheduler.pid, signal.SIGKILL)
    else:
        root = other.staff.pid if isinstance(other, cluster) else process.pid
        workers = [p for p in descendants(root) if "spawn_main" in " ".join(p.cmdline())]
        if workers:
            os.kill(dice.choice(workers).pid, signal.SIGKILL)


def descendants(pid: int) -> list[psutil.Process]:
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def await_records(process: subprocess.Popen[str], folder: Path, count: int) -> None:
    """Wait until a campaign has so many records, or has ended."""
    while process.poll() is None and lines(folder) < count:
        time.sleep(0.02)


def alive(process: subprocess.Popen[str], seconds: float) -> None:
    """Wait for a process, no longer than so many seconds."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return


def lines(folder: Path) -> int:
    path = folder / "records.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def records(folder: Path) -> list[dict]:
    """Return the records in the file's order, without their timing."""
    found = [json.loads(line) for line in (folder / "records.jsonl").read_text().splitlines()]
    return [{key: value for key, value in record.items() if key != "timing"} for record in found]


def first_difference(wanted: list[dict], found: list[dict]) -> str:
    for ours, theirs in zip(wanted, found):
        for key, value in ours.items():
            if theirs.get(key) != value:
                return f"{ours['key']} {key}: {value!r} undisturbed, {theirs.get(key)!r} here"
    return f"{len(wanted)} records undisturbed, {len(found)} here"


def contents(folder: Path, pattern: str) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob(pattern)}


if __name__ == "__main__":
    sys.exit(main())
