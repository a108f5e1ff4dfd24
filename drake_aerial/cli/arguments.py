"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from drake_aerial.errors import InputError

AXES = ("X", "Y", "Z")


def add_scan(command: argparse.ArgumentParser) -> None:
    """Add the cloud, its viewpoint and its up direction."""
    command.add_argument(
        "cloud",
        metavar="CLOUD",
        help="a .ply .pcd .obj .stl .npz or .npy file in metres, or the name of a shipped payload",
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
        default=(0.0, 0.0, 1.0),
        metavar=AXES,
        help="up direction in the scan frame (default: 0 0 1)",
    )


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
    """Add the switch that prints `what` as one line of JSON."""
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
