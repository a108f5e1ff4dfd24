"""The command ``learn``: learn a contact skill from one demonstration."""

import argparse
from pathlib import Path

from drake_aerial.cli.arguments import add_json, add_parameters, add_seed
from drake_aerial.cli.output import print_result


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "learn",
        help="learn a contact skill from one demonstration",
        description="Learn a contact skill from one demonstration.",
    )
    command.add_argument(
        "demonstration",
        metavar="DEMONSTRATION",
        help="a YAML file, or the name of a shipped demonstration",
    )
    command.add_argument(
        "--out", type=Path, required=True, metavar="SKILL.npz", help="file to write"
    )
    add_parameters(command, "learning")
    add_seed(command)
    add_json(command, "a summary")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Learn the skill and save it."""
    from drake_aerial import Demonstration, learn, read_parameters

    parameters = (
        None if arguments.parameters is None else read_parameters("learning", arguments.parameters)
    )
    skill = learn(
        Demonstration.read(arguments.demonstration), seed=arguments.seed, parameters=parameters
    )
    skill.save(arguments.out)
    print_result(
        arguments.json,
        {"skill": str(arguments.out), "label": skill.label, "grippers": len(skill)},
        f"learnt {skill.label!r} ({len(skill)} gripper(s)) -> {arguments.out}",
    )
    return 0
