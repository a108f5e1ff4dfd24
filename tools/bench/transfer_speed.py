#!/usr/bin/env python3
"""Time of a transfer, and of the densities that it evaluates, after all imports.

The scan has 20,000 points of a box with 1 mm of noise. Skills: one gripper (shipped demonstration
`flat`) and three (`formation`); the best five solutions are returned. `task` is the default
method, with 5,000 kernels per gripper; `paper` is the paper's, with N_Q = 1000. Parts: surface
features, query density, annealing with all that follows. The first call of a process also imports
modules that are loaded late; the second call repeats it.

Densities: 100,000 poses against 1,000 kernels, in double and single precision, for grippers with a
symmetry axis (the default of `transfer`) and without.

    tools/run python tools/bench/transfer_speed.py                    one core and all cores
    tools/run python tools/bench/transfer_speed.py --profile task 1   profile: method, grippers
"""

from __future__ import annotations

import argparse
import cProfile
import json
import os
import pstats
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

SIZE = np.array([0.68, 0.61, 0.28])
DEMONSTRATIONS = {1: "flat", 3: "formation"}
WANTED = {1: 1.0, 3: 2.5}
KDE_WANTED = 0.2
PARTS = ("features_s", "query_s", "optimise_s")


def scan() -> object:
    """Return the scan."""
    import trimesh

    from drake_aerial import PointCloud

    rng = np.random.default_rng(0)
    points = np.asarray(
        trimesh.sample.sample_surface(trimesh.creation.box(SIZE), 20_000, seed=1)[0]
    )
    return PointCloud.read(points + 0.001 * rng.standard_normal(points.shape))


def transfers(method: str, n: int) -> list[dict[str, float]]:
    """Transfer twice in this process; return wall and CPU seconds, and wall seconds by part."""
    from drake_aerial import read_skill, transfer

    skill, cloud, told = read_skill(DEMONSTRATIONS[n]), scan(), []
    for _ in range(2):
        wall, cpu = time.perf_counter(), time.process_time()
        found = transfer(skill, cloud, method=method, top=5)
        told.append(
            {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu, **found.timing}
        )
        told[-1]["solutions"] = len(found)
    return told


def densities() -> list[dict[str, float]]:
    """Evaluate densities of 1,000 kernels at 100,000 poses; return seconds."""
    from drake_aerial.density.pose_density import PoseDensity
    from drake_aerial.geometry import Pose, random_rotation

    rng, told = np.random.default_rng(0), []
    kernels_at = Pose((rng.random((1000, 3)) - 0.5) * SIZE, random_rotation(rng, 1000))
    x = Pose((rng.random((100_000, 3)) - 0.5) * SIZE, random_rotation(rng, 100_000))
    for axial in (True, False):
        for single in (False, True):
            density = PoseDensity(
                kernels_at, sigma_p=0.02, sigma_q=np.deg2rad(15.0), axial=axial, single=single
            )
            for call in range(3):
                wall, cpu = time.perf_counter(), time.process_time()
                density.log_density(x)
                row = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
                told.append({"axial": axial, "single": single, "call": call, **row})
    return told


def alone(arguments: list[str], cores: int) -> list[dict[str, float]]:
    """Run this script in a process of its own with `cores` cores; return what it prints."""
    environment = os.environ | {f"{key}_NUM_THREADS": str(cores) for key in ("OMP", "OPENBLAS")}
    command = [sys.executable, str(Path(__file__).resolve()), *arguments]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--methods", nargs="+", choices=["task", "paper"], default=["task", "paper"]
    )
    parser.add_argument("--cores", nargs="+", type=int, default=[1, 2], help="(default: 1 2)")
    parser.add_argument("--profile", nargs=2, metavar=("METHOD", "GRIPPERS"))
    parser.add_argument("--measure", nargs="+", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        what = arguments.measure
        print(
            json.dumps(densities() if what == ["densities"] else transfers(what[0], int(what[1])))
        )
        return 0
    if arguments.profile:
        method, n = arguments.profile[0], int(arguments.profile[1])
        transfers(method, n)
        profile = cProfile.Profile()
        profile.runcall(transfers, method, n)
        pstats.Stats(profile).sort_stats("tottime").print_stats(30)
        return 0
    print(
        f"{'transfer':<22}{'cores':>6}{'call':>6}{'wall s':>8}{'wanted':>8}{'CPU s':>8}"
        f"{'features':>10}{'query':>8}{'annealing':>11}"
    )
    for n, wanted in WANTED.items():
        for method in arguments.methods:
            for cores in arguments.cores:
                for call, row in enumerate(alone(["--measure", method, str(n)], cores)):
                    parts = "".join(
                        f"{row[name]:>{width}.2f}"
                        for name, width in zip(PARTS, (10, 8, 11), strict=True)
                    )
                    which = "first" if call == 0 else "2nd"
                    print(
                        f"{f'{method}, {n} gripper(s)':<22}{cores:>6}{which:>6}"
                        f"{row['wall']:>8.2f}{wanted:>8.1f}{row['cpu']:>8.2f}{parts}",
                        flush=True,
                    )
    print(
        f"\n{'100,000 poses x 1,000 kernels':<32}{'cores':>6}{'first s':>9}{'best s':>8}"
        f"{'wanted':>8}{'CPU s':>8}"
    )
    for cores in arguments.cores:
        rows = alone(["--measure", "densities"], cores)
        for k in range(0, len(rows), 3):
            rotation = "axis only" if rows[k]["axial"] else "full rotation"
            label = f"{rotation}, {'single' if rows[k]['single'] else 'double'}"
            best = min(rows[k : k + 3], key=lambda row: row["wall"])
            print(
                f"{label:<32}{cores:>6}{rows[k]['wall']:>9.3f}{best['wall']:>8.3f}"
                f"{KDE_WANTED:>8.1f}{best['cpu']:>8.3f}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
