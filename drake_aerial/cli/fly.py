"""The command ``fly``: fly one of the solutions of a transfer."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.choices import BELIEFS, CABLES, CONTROLLERS, RETIMINGS
from drake_aerial.cli.arguments import add_json, add_live, add_seed, live_is_wanted, whole_number
from drake_aerial.cli.output import print_result, progress_bar, say, say_assumptions
from drake_aerial.errors import InputError

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "fly",
        help="fly one of the solutions of a transfer",
        description="Fly one of the solutions of a transfer. Infeasible set-ups are rejected "
        "before the simulation, with the reason: exit code 1 if the contacts are marked "
        "infeasible, taut cables cannot hold the payload, a quadrotor's share of the weight is "
        "too large or the path is impossible; 2 if the team cannot lift the payload.",
    )
    command.add_argument(
        "contacts", type=Path, metavar="contacts.json", help="file that `transfer` wrote"
    )
    command.add_argument("--out", type=Path, required=True, metavar="DIR", help="output folder")
    payload = command.add_mutually_exclusive_group()
    payload.add_argument(
        "--payload",
        metavar="NAME|FILE",
        help="payload: a shipped one or a YAML file (default: the scan's hull)",
    )
    payload.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="mass of a payload that is known only by its scan (default: 0.25)",
    )
    command.add_argument(
        "--cloud",
        metavar="CLOUD",
        help="the scan, if contacts.json names no file or the file has moved; its viewpoint, up "
        "and camera are those of contacts.json",
    )
    command.add_argument(
        "--topic",
        metavar="NAME",
        help="topic of the points, if CLOUD is a bag (default: that of contacts.json)",
    )
    command.add_argument(
        "--solution",
        type=whole_number(1),
        default=1,
        metavar="RANK",
        help="rank of the solution (default: 1)",
    )
    add_seed(command)
    command.add_argument(
        "--belief",
        choices=BELIEFS,
        default="below_contact",
        help="centre of mass and inertia that the controller assumes (default: below_contact)",
    )
    command.add_argument(
        "--controller",
        default="mpc",
        metavar="NAME|FILE",
        help=f"{', '.join(CONTROLLERS)}, or a YAML file (default: mpc)",
    )
    command.add_argument(
        "--trajectory",
        default="transport",
        metavar="NAME|FILE",
        help="transport, hover, line, waypoints, or a YAML file (default: transport)",
    )
    command.add_argument(
        "--retime",
        nargs="?",
        choices=RETIMINGS,
        const="slower",
        metavar="MODE",
        help="slower (default if MODE is left out): slow only the moves that exceed a limit; "
        "fastest: fly every move except the lift as fast as the limits permit",
    )
    _add_station(command)
    command.add_argument(
        "--force",
        action="store_true",
        help="fly although the contacts are infeasible, the payload is too heavy, or the path is "
        "impossible",
    )
    command.add_argument(
        "--graphviz",
        type=Path,
        metavar="FILE",
        help="also draw the diagram (.dot, .gv, .svg, .png or .pdf)",
    )
    add_live(command, "show the flight in Meshcat while it is simulated, in real time at most")
    add_json(command, "the metrics")
    command.set_defaults(run=run)


def _add_station(command: argparse.ArgumentParser) -> None:
    """Add the files of the station and its parts."""
    command.add_argument(
        "--station",
        metavar="FILE.yaml",
        help="team, wind and sensors (default: the paper's); the next four options override its "
        "parts",
    )
    command.add_argument("--quadrotor", metavar="FILE.yaml", help="parameters of all quadrotors")
    command.add_argument(
        "--cable",
        metavar="KIND|FILE",
        help=f"{', '.join(CABLES)}, or a YAML file with parameters of all cables",
    )
    command.add_argument("--gripper", metavar="FILE.yaml", help="parameters of all grippers")
    command.add_argument("--wind", metavar="FILE.yaml", help="parameters of the wind")


def run(arguments: argparse.Namespace) -> int:
    """Fly the solution; save the trial and its replay. Fail unless the flight is completed."""
    from drake_aerial import prepare_flight, write_diagram_picture
    from drake_aerial.configuration import read_controller, read_station
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.visualization.replay import write_replay

    live = live_is_wanted(arguments)
    parameters = read_station(
        arguments.station,
        quadrotor=arguments.quadrotor,
        cable=arguments.cable,
        gripper=arguments.gripper,
        wind=arguments.wind,
    )
    with progress_bar("fly") as progress:
        flight = prepare_flight(
            arguments.contacts,
            payload=arguments.payload,
            mass=arguments.mass,
            solution=arguments.solution,
            cloud=_scan(arguments),
            belief=arguments.belief,
            controller=read_controller(arguments.controller),
            trajectory=arguments.trajectory,
            parameters=parameters,
            retime=arguments.retime,
            force=arguments.force,
        )
        for note in flight.path.notes:
            say(note)
        if arguments.graphviz:
            write_diagram_picture(arguments.graphviz, flight.station)
        if live:
            from drake_aerial.visualization.live_view import live_flight

            with live_flight(
                flight,
                port=arguments.port,
                open_browser=not arguments.no_browser,
                tell=lambda url: say(f"Meshcat: {url} (Ctrl-C: stop)"),
            ) as watch:
                result = flight.run(arguments.seed, progress=progress, watch=watch)
        else:
            result = flight.run(arguments.seed, progress=progress)
    if arguments.payload is None:
        say_assumptions(ContactSolutions.read(arguments.contacts).cloud)
        say_assumptions(result.metrics["configuration"]["payload"])
    result.save(arguments.out)
    write_replay(arguments.out / "flight.html", result)
    print_result(arguments.json, result.metrics, f"{result.summary()}\n-> {arguments.out}")
    return 0 if result.outcome == "completed" else 1


def _scan(arguments: argparse.Namespace) -> PointCloud | None:
    """Return the scan that is given, read with the viewpoint, up and camera of the contacts."""
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.named_inputs import read_scan
    from drake_aerial.scene.bags import is_bag
    from drake_aerial.scene.recorded_scan import read_recorded_scan

    path, topic = arguments.cloud, arguments.topic
    if topic is not None and (path is None or not is_bag(Path(path))):
        raise InputError("--topic needs --cloud BAG, a bag")
    if path is None:
        return None
    if not os.path.exists(path):
        return read_scan(path)
    record = ContactSolutions.read(arguments.contacts).cloud
    return read_recorded_scan(record if topic is None else {**record, "topic": topic}, path)
