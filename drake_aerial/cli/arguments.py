"""Arguments that several verbs take, and the kinds of number that argparse does not know."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.cli.answer import tell_assumptions

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud


def add_scan(verb: argparse.ArgumentParser) -> None:
    """Add the cloud, where its sensor was and which way is up."""
    verb.add_argument(
        "cloud",
        metavar="CLOUD",
        help="a scan (.ply .pcd .obj .stl .npy .npz .xyz .txt .csv .pts .las ...), "
        "or the name of a shipped payload",
    )
    verb.add_argument(
        "--viewpoint", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where the sensor was [m]"
    )
    verb.add_argument(
        "--up",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="against gravity (default: 0 0 1; needed for a scan in camera axes)",
    )
    verb.add_argument(
        "--camera",
        type=Path,
        metavar="FILE.yaml",
        help="the intrinsics, if CLOUD is a depth image (.png .tif .npy .exr)",
    )


def scan_of(arguments: argparse.Namespace) -> PointCloud:
    """Read the cloud, and print what was assumed about it."""
    from drake_aerial.named_inputs import read_scan

    cloud = read_scan(
        arguments.cloud,
        viewpoint=arguments.viewpoint,
        up=arguments.up,
        camera=arguments.camera,
    )
    tell_assumptions(cloud.assumptions)
    return cloud


def add_parameters(verb: argparse.ArgumentParser, noun: str) -> None:
    """Add a configuration file of the verb's own noun."""
    verb.add_argument(
        "--parameters",
        metavar="FILE.yaml",
        help=f"what differs from `drake-aerial defaults {noun}`",
    )


def add_seed(verb: argparse.ArgumentParser) -> None:
    """Add the seed of everything random that the verb does."""
    verb.add_argument(
        "--seed", type=whole_number, default=0, help="of all that is random (default: 0)"
    )


def add_json(verb: argparse.ArgumentParser, what: str) -> None:
    """Add the switch that prints `what` as one line of JSON."""
    verb.add_argument("--json", action="store_true", help=f"print {what} as JSON on stdout")


def positive_number(text: str) -> int:
    """Return a whole number from 1."""
    value = int(text) if text.lstrip("+").isdigit() else 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} given, a whole number from 1 is accepted")
    return value


def whole_number(text: str) -> int:
    """Return a whole number from 0."""
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} given, a whole number from 0 is accepted")
    return int(text)
