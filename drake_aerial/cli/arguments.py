"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.cli.output import say, say_assumptions
from drake_aerial.errors import InputError

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud

AXES = ("X", "Y", "Z")


def add_scan(command: argparse.ArgumentParser) -> None:
    """Add the cloud, its viewpoint and its up direction."""
    command.add_argument(
        "cloud",
        metavar="CLOUD",
        help="a scan in metres (.ply .pcd .obj .stl .npy .npz .xyz .txt .csv .pts .las ...), "
        "a depth image (with --camera), a bag (with --topic), or the name of a shipped payload",
    )
    command.add_argument(
        "--viewpoint",
        type=float,
        nargs=3,
        metavar=AXES,
        help="position of the sensor in the scan frame [m]",
    )
    command.add_argument(
        "--up",
        type=float,
        nargs=3,
        metavar=AXES,
        help="up direction in the scan frame (default: 0 0 1; needed for a scan in camera axes)",
    )
    command.add_argument(
        "--camera",
        type=Path,
        metavar="FILE.yaml",
        help="intrinsics, if CLOUD is a depth image (.png .tif .npy .exr)",
    )
    command.add_argument(
        "--topic",
        metavar="NAME",
        help="topic of PointCloud2 or depth Image, if CLOUD is a bag (rosbag2 folder .mcap .db3 "
        ".bag)",
    )


def add_object(command: argparse.ArgumentParser, *, at: bool = True) -> None:
    """Add the choice of an object, if the scan is a scene."""
    choice = command.add_mutually_exclusive_group()
    choice.add_argument(
        "--object",
        type=whole_number(2),
        metavar="N",
        help="number of the payload in a scene (see `drake-aerial scene`; default: the only one)",
    )
    choice.add_argument(
        "--pixel",
        type=float,
        nargs=2,
        metavar=("U", "V"),
        help="a pixel on the payload, column and row, instead of its number",
    )
    if at:
        choice.add_argument(
            "--at",
            type=float,
            nargs=3,
            metavar=AXES,
            help="a point on the payload in the scan frame [m], instead of its number",
        )
    choice.add_argument(
        "--whole",
        action="store_true",
        help="take all points as the payload, without a search for objects",
    )


def scan_of(arguments: argparse.Namespace) -> PointCloud:
    """Return the whole scan."""
    from drake_aerial.named_inputs import read_scan

    return read_scan(
        arguments.cloud,
        viewpoint=arguments.viewpoint,
        up=arguments.up,
        camera=arguments.camera,
        topic=arguments.topic,
    )


def object_of(
    arguments: argparse.Namespace, point: tuple[float, float, float] | None = None
) -> PointCloud:
    """Return the chosen object of the scan, and print what was assumed about it.

    If several objects are found and none is chosen, they are listed before the error is raised.
    A payload's name is a model, not a scene.
    """
    from drake_aerial.scene.object_choice import ObjectChoice, ObjectsNotChosenError, chosen_object

    pixel = arguments.pixel
    choice = ObjectChoice(
        arguments.object, None if pixel is None else (pixel[0], pixel[1]), point, arguments.whole
    )
    cloud = scan_of(arguments)
    try:
        if choice or cloud.path is not None:
            cloud = chosen_object(cloud, choice)
    except ObjectsNotChosenError as error:
        say(error.scene.summary())
        raise
    say_assumptions(cloud.to_record())
    return cloud


def add_parameters(command: argparse.ArgumentParser, component: str) -> None:
    """Add a configuration file of the command's own component."""
    command.add_argument(
        "--parameters",
        metavar="FILE.yaml",
        help=f"YAML file that overrides the defaults (see `drake-aerial defaults {component}`)",
    )


def add_seed(command: argparse.ArgumentParser) -> None:
    """Add the random seed."""
    command.add_argument(
        "--seed", type=whole_number(0), default=0, metavar="N", help="random seed (default: 0)"
    )


def add_json(command: argparse.ArgumentParser, what: str) -> None:
    """Add ``--json``, which prints `what` as one line of JSON."""
    command.add_argument("--json", action="store_true", help=f"print {what} as JSON on stdout")


def add_live(command: argparse.ArgumentParser, meaning: str) -> None:
    """Add ``--live`` and its options."""
    command.add_argument("--live", action="store_true", help=meaning)
    command.add_argument(
        "--port", type=int, help="port of Meshcat (default: the first free one from 7000)"
    )
    command.add_argument(
        "--no-browser", action="store_true", help="print Meshcat's URL and open no browser"
    )


def live_is_wanted(arguments: argparse.Namespace) -> bool:
    """Return True if ``--live`` is given.

    Raises
    ------
    InputError
        If it is not, but one of its options is.
    """
    if not arguments.live and (arguments.port is not None or arguments.no_browser):
        raise InputError("--port and --no-browser need --live")
    return bool(arguments.live)


def whole_number(lowest: int) -> Callable[[str], int]:
    """Return an argument type: whole numbers from `lowest`."""

    def parse(text: str) -> int:
        if not text.isdigit() or int(text) < lowest:
            raise argparse.ArgumentTypeError(
                f"must be a whole number of at least {lowest}, got {text!r}"
            )
        return int(text)

    return parse
