#!/usr/bin/env python3
"""Warm-up of the first run after installation, with nothing cached.

The package and its models are copied to a temporary folder without bytecode, and HOME is empty
(no caches of fonts or pages). The installed dependencies are as pip leaves them. Three groups
run, each in a fresh copy: a Python process that learns, transfers and flies; the commands learn,
transfer, fly and view one after another; and the command demo. Every process does its job twice.
The table shows

    warm-up = start of Python + first call - second call     (imports, bytecode, fonts, compilation)

`imports` is the part that Python counts as imports (-X importtime, wall). `next time` is the
warm-up of the same process run once more, with the caches of the first. The flight is 1 s of
hover, so that the scatter of flights does not hide the difference. Files are in the machine's
page cache: time of the disk is not measured.

    tools/run python tools/bench/first_run.py                 everything
    tools/run python tools/bench/first_run.py --only python   one of: python, commands, demo
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

WANTED = 5.0
HOVER = "kind: hover\nhover_time: 1.0\n"
COMMANDS = {
    "learn": ["learn", "flat", "--out", "skill.npz"],
    "transfer": [
        "transfer",
        "skill.npz",
        "scan.npz",
        "--out",
        "contacts.json",
        "--html",
        "contacts.html",
    ],
    "fly": [
        "fly",
        "contacts.json",
        "--mass",
        "0.25",
        "--trajectory",
        "hover.yaml",
        "--out",
        "flight",
    ],
    "view": ["view", "flight/trial.npz", "--out", "flight.html"],
    "demo": ["demo", "--out", "demo"],
}


@dataclass
class Waits:
    """Seconds (wall, CPU) of one process: its start, its first calls and its second calls."""

    start: tuple[float, float]
    first: tuple[float, float]
    second: tuple[float, float]
    imports: float = 0.0
    parts: dict[str, float] | None = None

    @property
    def warm_up(self) -> tuple[float, float]:
        """Seconds (wall, CPU) beyond the work itself."""
        return tuple(s + a - b for s, a, b in zip(self.start, self.first, self.second, strict=True))  # type: ignore[return-value]


def clock() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def timed(job: Callable[[], object]) -> tuple[float, float]:
    """Return wall and CPU seconds of a call; discard its output."""
    began = clock()
    with contextlib.redirect_stdout(io.StringIO()):
        job()
    ended = clock()
    return ended[0] - began[0], ended[1] - began[1]


def python_jobs() -> dict[str, Callable[[], object]]:
    """Return the chain's three calls as a Python user writes them, imports within."""

    def learning():
        import drake_aerial as da

        return da.learn(da.Demonstration.read("flat"))

    def transferring():
        import drake_aerial as da

        return da.transfer(da.ContactSkill.load("skill.npz"), da.PointCloud.read("scan.npz"))

    def flying():
        import drake_aerial as da
        from drake_aerial.references.trajectory import HoverTrajectory
        from drake_aerial.simulation.flight import Flight
        from drake_aerial.simulation.flight_options import FlightOptions
        from drake_aerial.simulation.suspended_payload import SuspendedPayload

        held = SuspendedPayload.from_contacts(
            da.Payload.read("box_68x68x28"), [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]]
        )
        return Flight(held, FlightOptions(trajectory=HoverTrajectory(hover_time=1.0))).run(0)

    return {"learn": learning, "transfer": transferring, "Flight.run": flying}


def be_the_newcomer(what: str, started: float) -> None:
    """Do a job twice in this process and print what it took."""
    start = time.time() - started, time.process_time()
    if what == "python":
        jobs = python_jobs()
    else:
        from drake_aerial.cli import main as command

        # The command line's own imports belong to the start.
        start = time.time() - started, time.process_time()
        jobs = {what: lambda: command(COMMANDS[what])}
    if not Path(__import__("drake_aerial").__file__).is_relative_to(Path.cwd()):
        raise RuntimeError("the fresh copy was not the one imported")
    first = {name: timed(job) for name, job in jobs.items()}
    second = {name: timed(job) for name, job in jobs.items()}
    total = [
        tuple(sum(took[k] for took in calls.values()) for k in (0, 1)) for calls in (first, second)
    ]
    parts = {name: first[name][1] - second[name][1] for name in jobs}
    print(json.dumps({"start": start, "first": total[0], "second": total[1], "parts": parts}))


def newcomer(what: str, place: Path) -> Waits:
    """Return the waiting times of a process of its own."""
    keep = ("PATH", "LANG", "LD_LIBRARY_PATH", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {key: os.environ[key] for key in keep if key in os.environ}
    environment |= {"HOME": str(place / "home"), "PYTHONPATH": str(place / "installed")}
    command = [
        sys.executable,
        "-X",
        "importtime",
        str(Path(__file__).resolve()),
        "--newcomer",
        what,
        str(time.time()),
    ]
    done = subprocess.run(
        command, cwd=place, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        told = "\n".join(
            line for line in done.stderr.splitlines() if not line.startswith("import time:")
        )
        raise RuntimeError(f"{what} failed:\n{told}")
    told = [line.split("|") for line in done.stderr.splitlines() if line.startswith("import time:")]
    imports = sum(
        int(line[0].removeprefix("import time:")) for line in told if line[0].split()[-1].isdigit()
    )
    return Waits(**json.loads(done.stdout.splitlines()[-1]), imports=1e-6 * imports)


def fresh_copy(place: Path) -> Path:
    """Copy the package and its models, without bytecode, and make the inputs; return the folder."""
    import drake_aerial

    package = Path(drake_aerial.__file__).parent
    shutil.copytree(
        package, place / "installed" / package.name, ignore=shutil.ignore_patterns("__pycache__")
    )
    if not (package / "share" / "models").exists():
        shutil.copytree(package.parent / "models", place / "installed" / "models")
    (place / "home").mkdir()
    (place / "hover.yaml").write_text(HOVER)
    return place


def make_inputs(place: Path) -> None:
    """Scan a payload and learn a skill, by the package itself and not by its copy."""
    import numpy as np

    import drake_aerial as da
    from drake_aerial.demo import VIEWPOINT, scan_of

    da.learn(da.Demonstration.read("flat")).save(place / "skill.npz")
    scan = scan_of(da.Payload.read("box_68x68x28"), seed=0)
    np.savez_compressed(place / "scan.npz", points=scan.points, viewpoint=np.array(VIEWPOINT))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only",
        nargs="+",
        choices=("python", "commands", "demo"),
        default=("python", "commands", "demo"),
    )
    parser.add_argument("--newcomer", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.newcomer:
        be_the_newcomer(arguments.newcomer[0], float(arguments.newcomer[1]))
        return 0
    groups = {
        "python": ["python"],
        "commands": ["learn", "transfer", "fly", "view"],
        "demo": ["demo"],
    }
    print(
        f"{'':<10}{'imports s':>10}{'second call s':>15}{'warm-up s':>11}{'CPU s':>7}"
        f"{'next time s':>13}{'CPU s':>7}"
    )
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        inputs = Path(folder) / "inputs"
        inputs.mkdir()
        make_inputs(inputs)
        for name in arguments.only:
            place = fresh_copy(Path(folder) / name)
            for path in inputs.iterdir():
                shutil.copy(path, place)
            new = {what: newcomer(what, place) for what in groups[name]}
            again = {what: newcomer(what, place) for what in groups[name]}
            for what, waits in new.items():
                wall, cpu = waits.warm_up
                later = again[what].warm_up
                print(
                    f"{what:<10}{waits.imports:>10.2f}{waits.second[0]:>15.2f}"
                    f"{wall:>11.2f}{cpu:>7.2f}{later[0]:>13.2f}{later[1]:>7.2f}",
                    flush=True,
                )
            if name == "python":
                told = ", ".join(
                    f"{part} {cpu:.2f}" for part, cpu in (new["python"].parts or {}).items()
                )
                print(f"{'':<10}first call less second, CPU s: {told}")
            worst = max(waits.warm_up[1] for waits in new.values())
            missed += [name] * (worst > WANTED)
    print(
        f"wanted: at most {WANTED:g} s of CPU in any process"
        + (f"; MISSED by {', '.join(missed)}" if missed else "")
    )
    return int(bool(missed))


if __name__ == "__main__":
    sys.exit(main())
