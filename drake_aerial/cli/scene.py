"""The command ``scene``: find gravity, supports and objects in a depth image or cloud."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.cli.arguments import add_json, add_object, add_scan, scan_of
from drake_aerial.cli.output import print_result, say_assumptions

if TYPE_CHECKING:
    from drake_aerial.scene.scene import Scene


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "scene",
        help="find gravity, supports and objects in a depth image or cloud",
        description="Find gravity, the supports and the objects that stand on them in a depth "
        "image, a cloud or a bag. `transfer` and `demonstrate` take the numbers of the objects.",
    )
    add_scan(command)
    add_object(command)
    command.add_argument(
        "--labels",
        type=Path,
        metavar="FILE.png",
        help="also write an image of numbers: 0 nothing, 1 a support, 2 and up the objects",
    )
    command.add_argument(
        "--html", type=Path, metavar="FILE", help="also write an HTML page that shows the scene"
    )
    add_json(command, "the scene")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Find the scene and print it, or the one object that is chosen."""
    from drake_aerial.scene.find_scene import find_scene
    from drake_aerial.scene.label_image import write_labels
    from drake_aerial.scene.object_choice import ObjectChoice
    from drake_aerial.scene.scene_image import SceneImage

    pixel, cloud = arguments.pixel, scan_of(arguments)
    choice = ObjectChoice(
        arguments.object, None if pixel is None else (pixel[0], pixel[1]), arguments.at
    )
    # The direction of gravity is what the scene finds.
    said = [a for a in cloud.to_record().get("assumptions", []) if a["kind"] != "up"]
    say_assumptions({"assumptions": said})
    scene: Scene = find_scene(SceneImage.of_cloud(cloud))
    document = {"cloud": cloud.to_record(), **scene.to_record()}
    text = scene.summary()
    if choice:
        found = choice.of(scene)
        document["objects"] = [found.to_record()]
        text = found.summary()
    written = []
    if arguments.labels:
        write_labels(arguments.labels, scene)
        written.append(arguments.labels)
    if arguments.html:
        from drake_aerial.visualization.scene_page import write_scene_page

        write_scene_page(arguments.html, scene)
        written.append(arguments.html)
    print_result(arguments.json, document, "\n".join([text, *(f"-> {file}" for file in written)]))
    return 0
