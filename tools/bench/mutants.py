#!/usr/bin/env python3
"""What the tests of the core would not notice: small faults are put into a copy of the package, one at a time.

A mutant is one change of one expression or statement: an operator, a sign, a comparison, a constant or an index, a
function's counterpart (max for min, sine for cosine), operands or branches exchanged, a transposition left out, a
statement dropped (`mutations.py`). Of every module of the core the same number is drawn. A mutant is killed if the module's own tests
(`CORE`) fail, or take ten times their CPU time; others of the suite may well kill what survives here.

Survivors that cannot change a result, or that no test should forbid (speed, tolerances, blocks of memory), are in
`tools/bench/equivalent_mutants.txt` with their reasons; they are counted apart. Messages, annotations and docstrings
are not mutated.

    tools/run python tools/bench/mutants.py                                 15 of each module (some 5 CPU minutes, more on a busy machine)
    tools/run python tools/bench/mutants.py --only control/ --count 30
    tools/run python tools/bench/mutants.py --again printed.txt             those that an earlier run printed
    tools/run python tools/bench/mutants.py --list --only hull              every mutant there is, none run
"""

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import argparse
import importlib
import resource
import shutil
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from mutations import Mutant, mutants_of

ROOT = Path(__file__).resolve().parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.txt")
# Imported once, before the tests' processes fork; the package itself is not among them.
HEAVY = (
    *("pytest", "hypothesis", "open3d", "trimesh", "pydrake.all", "matplotlib.figure", "yaml", "piqp", "threadpoolctl"),
    *("scipy.integrate", "scipy.ndimage", "scipy.optimize", "scipy.sparse.csgraph", "scipy.spatial.transform"),
)
COLUMNS = ("mutants", "killed", "by time", "equivalent", "survived")
PERCEPTION, DENSITY, LEARNING = "perception/test_{}.py", "density/test_{}.py", "learning/test_{}.py"
TRANSFERRING, CONTROL = "transferring/test_{}.py", "control/test_{}.py"
CORE = {
    "perception/surface_features.py": (PERCEPTION, "surface_features"),
    "perception/neighbourhoods.py": (PERCEPTION, "neighbourhoods", "surface_features"),
    "perception/orientation.py": (PERCEPTION, "orientation", "surface_features"),
    "perception/canonical.py": (PERCEPTION, "canonical"),
    "density/kernels.py": (DENSITY, "kernels"),
    "density/mixture.py": (DENSITY, "mixture", "pose_density", "surface_density"),
    "density/pose_density.py": (DENSITY, "pose_density"),
    "density/surface_density.py": (DENSITY, "surface_density"),
    "learning/configuration_model.py": (LEARNING, "configuration_model"),
    "learning/contact_model.py": (LEARNING, "contact_model", "learn"),
    "learning/object_model.py": (LEARNING, "object_model", "learn"),
    "learning/task_model.py": (LEARNING, "task_model", "learn"),
    "learning/hull.py": (LEARNING, "hull"),
    "transferring/likelihood.py": (TRANSFERRING, "likelihood", "formation_transfer"),
    "transferring/query_density.py": (TRANSFERRING, "query_density"),
    "transferring/grid_density.py": (TRANSFERRING, "grid_density"),
    "control/payload_model.py": (CONTROL, "payload_model"),
    "control/payload_linearization.py": (CONTROL, "payload_linearization"),
    "control/condensing.py": (CONTROL, "condensing"),
    "control/tracking_error.py": (CONTROL, "tracking_error"),
    "control/horizon.py": (CONTROL, "horizon", "mpc"),
}


def outcome(folder: Path, tests: list[str], limit: float | None) -> tuple[int, float]:
    """Run tests against the package in `folder` in a process of their own; return 0 if they pass, and CPU seconds."""
    child = os.fork()
    if child:
        _, status, used = os.wait4(child, 0)
        return status, used.ru_utime + used.ru_stime
    try:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        if limit is not None:
            sys.dont_write_bytecode = True
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 2))
            resource.setrlimit(resource.RLIMIT_AS, (16 << 30, 16 << 30))
            signal.alarm(int(20.0 * limit) + 1)  # for those that wait
        sys.path.insert(0, str(folder))
        os.chdir(ROOT)
        import pytest

        options = ["-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-p", "no:dash", "--tb=no"]
        marks = ["-o", "addopts=", "-m", "not slow and not browser and not fuzz", f"--basetemp={folder / 'tmp'}"]
        code = pytest.main([*options, *marks, *tests])
        import drake_aerial

        os._exit(int(code) if str(folder) in str(drake_aerial.__file__) else 99)
    except BaseException:
        os._exit(98)


def examine(module: str, mutants: list[Mutant], folder: Path, known: dict[tuple[str, str], str]) -> Counter:
    """Run the mutants of one module, print those that survive, and return the counts."""
    tests = [str(ROOT / "tests" / CORE[module][0].format(name)) for name in CORE[module][1:]]
    path, count = folder / "drake_aerial" / module, Counter(mutants=len(mutants))
    whole = path.read_text()
    status, seconds = outcome(folder, tests, None)
    if status:
        sys.exit(f"the tests of {module} do not pass as they are (status {status})")
    lines = []
    for mutant in mutants:
        rewrite(path, mutant.text)
        status, used = outcome(folder, tests, 10.0 * seconds + 5.0)
        count["seconds"] += used
        if status:
            count["killed"] += 1
            count["by time"] += os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGALRM)
        elif why := known.get(mutant.name):
            count["equivalent"] += 1
            lines.append(f"    {mutant}  ({why})")
        else:
            count["survived"] += 1
            lines.append(f"    {mutant}")
    rewrite(path, whole)
    row(module, count)
    for line in lines:
        print(line, flush=True)
    return count


def rewrite(path: Path, text: str) -> None:
    """Write a module, without the compiled one, which a change of the same size within a second would leave in force."""
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
        compiled.unlink()
    path.write_text(text)


def row(name: str, count: Counter) -> None:
    judged = count["mutants"] - count["equivalent"]
    percent = 100.0 * count["survived"] / judged if judged else 0.0
    numbers = "".join(f"{count[name]:>11}" for name in COLUMNS)
    print(f"{name:<36}{numbers}{percent:>9.0f} %{count['seconds']:>8.0f} s", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=15, help="mutants of each module (default: 15)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (default: 0)")
    parser.add_argument("--only", default="", help="modules whose path contains this")
    parser.add_argument("--again", type=Path, help="the printed table of an earlier run: the mutants named there alone")
    parser.add_argument("--list", action="store_true", help="print all mutants and run none")
    arguments = parser.parse_args()
    known = dict(line.split("  #  ") for line in EQUIVALENT.read_text().splitlines())
    printed = (
        {line.partition("  (")[0].strip() for line in arguments.again.read_text().splitlines()}
        if arguments.again
        else ()
    )
    chosen = {}
    for module in filter(lambda module: arguments.only in module, CORE):
        every = mutants_of(module, ROOT / "drake_aerial" / module)
        order = np.random.default_rng([arguments.seed, list(CORE).index(module)]).permutation(len(every))
        drawn = every if printed or arguments.list else [every[k] for k in sorted(order[: arguments.count])]
        chosen[module] = [mutant for mutant in drawn if not printed or str(mutant) in printed]
    if arguments.list:
        print("\n".join(str(mutant) for mutants in chosen.values() for mutant in mutants))
        return 0
    for name in HEAVY:
        importlib.import_module(name)
    print(f"{'module':<36}{''.join(f'{name:>11}' for name in COLUMNS)}   survival       CPU")
    total = Counter()
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(
            ROOT / "drake_aerial", Path(folder, "drake_aerial"), ignore=shutil.ignore_patterns("__pycache__")
        )
        Path(folder, "models").symlink_to(ROOT / "models")
        for module, mutants in chosen.items():
            if mutants:
                total += examine(module, mutants, Path(folder), known)
    row("together", total)
    return 0


if __name__ == "__main__":
    sys.exit(main())
