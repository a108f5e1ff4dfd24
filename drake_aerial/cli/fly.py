"""The verb ``fly``: fly one of the solutions of a transfer."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.cli.answer import answer, tell_assumptions
from drake_aerial.cli.arguments import add_json, add_seed, positive_number
from drake_aerial.cli.live import add_live, live_is_wanted, tell_address
from drake_aerial.cli.progress import progress_bar

# Named here again, since a parser that asked the library for them would load Drake to print its help.
BELIEFS = ("below_contact", "geometric", "true")


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "fly",
        help="fly one of the solutions of a transfer",
        description="Fly one of the solutions of a transfer. What is known not to fly is refused before take-off with its reason: exit code 1 "
        "for contacts (marked infeasible, no taut equilibrium, more than a quadrotor's share), 2 for a payload that the team cannot lift.",
    )
    verb.add_argument("contacts", type=Path, metavar="contacts.json")
    verb.add_argument("--out", type=Path, required=True, metavar="DIR")
    payload = verb.add_mutually_exclusive_group()
    payload.add_argument(
        "--payload",
        metavar="PAYLOAD",
        help="a YAML file or the name of a shipped payload (default: the scan's hull)",
    )
    payload.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="mass of a payload known by its scan alone (default: 0.25)",
    )
    verb.add_argument("--solution", type=positive_number, default=1, metavar="RANK")
    add_seed(verb)
    verb.add_argument(
        "--belief",
        choices=BELIEFS,
        default="below_contact",
        help="what the controller takes for the centre of mass",
    )
    verb.add_argument(
        "--controller",
        default="mpc",
        metavar="NAME|FILE",
        help="mpc, geometric_ff, geometric, or a YAML file (default: mpc)",
    )
    verb.add_argument(
        "--trajectory",
        default="circle",
        metavar="NAME|FILE",
        help="a trajectory's name or YAML file (default: circle)",
    )
    verb.add_argument(
        "--station", metavar="FILE.yaml", help="team, wind, noise (default: the paper's)"
    )
    verb.add_argument(
        "--quadrotor", metavar="FILE.yaml", help="all quadrotors, instead of the station's"
    )
    verb.add_argument(
        "--cable",
        metavar="KIND|FILE",
        help="all cables, instead of the station's: a YAML file, or the kind alone, inextensible or elastic",
    )
    verb.add_argument(
        "--gripper", metavar="FILE.yaml", help="all grippers, instead of the station's"
    )
    verb.add_argument("--wind", metavar="FILE.yaml", help="instead of the station's")
    verb.add_argument(
        "--force",
        action="store_true",
        help="fly also a solution marked infeasible, contacts by which no taut cables hold the payload, or too heavy a payload",
    )
    verb.add_argument(
        "--graphviz",
        type=Path,
        metavar="FILE",
        help="also draw the diagram (.dot, or .svg, .png, .pdf)",
    )
    add_live(verb, "show the flight in Meshcat while it is simulated, not faster than real time")
    add_json(verb, "the metrics")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Fly the solution and save the trial with its replay; fail unless the flight is completed."""
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
            belief=arguments.belief,
            controller=read_controller(arguments.controller),
            trajectory=arguments.trajectory,
            parameters=parameters,
            force=arguments.force,
        )
        if arguments.graphviz:
            write_diagram_picture(arguments.graphviz, flight.station)
        if live:
            from drake_aerial.visualization.live import live_flight

            with live_flight(
                flight,
                port=arguments.port,
                open_browser=not arguments.no_browser,
                tell=tell_address,
            ) as watch:
                result = flight.run(arguments.seed, progress=progress, watch=watch)
        else:
            result = flight.run(arguments.seed, progress=progress)
    if arguments.payload is None:
        assumptions = ContactSolutions.read(arguments.contacts).cloud.get("assumptions", [])
        tell_assumptions(f"{known['kind']}: {known['text']}" for known in assumptions)
    result.save(arguments.out)
    write_replay(arguments.out / "flight.html", result)
    answer(arguments.json, result.metrics, f"{result.summary()}\n-> {arguments.out}")
    return 0 if result.metrics["outcome"] == "completed" else 1
