"""The verb ``learn``: a contact skill from one demonstration."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.cli.answer import answer
from drake_aerial.cli.arguments import add_json, add_parameters, add_seed


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser("learn", help="learn a contact skill from one demonstration")
    verb.add_argument(
        "demonstration",
        metavar="DEMONSTRATION",
        help="a YAML file or the name of a shipped demonstration",
    )
    verb.add_argument("--out", type=Path, required=True, metavar="SKILL.npz")
    add_parameters(verb, "learning")
    add_seed(verb)
    add_json(verb, "a summary")
    verb.set_defaults(run=run)


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
    answer(
        arguments.json,
        {"skill": str(arguments.out), "label": skill.label, "grippers": len(skill)},
        f"learnt {skill.label!r} ({len(skill)} gripper(s)) -> {arguments.out}",
    )
    return 0
