"""Take screenshots of each kind of page for docs/gallery.md.

Usage: tools/run python tools/screenshots.py [DIR] [--study STUDY]

Each PNG has a wide and a narrow screen side by side. The default folder is docs/images/pages. With
the folder of a study, the page of its report is included. The PNGs are kept with the sources,
because not every machine that builds the docs has a browser. Needs the package's `dev` extra
(Playwright) and Chromium.
"""

import argparse
import io
import shutil
import sys
import tempfile
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parent.parent
SCREENS = ((1280, 800), (390, 780))
HEIGHT = 520
GAP = 16
LARGEST = 150_000
FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]


def make_pages(folder: Path) -> dict[str, Path]:
    """Write one page of each kind; return them by the name of their picture."""
    from drake_aerial import prepare_flight, read_scan, read_skill, transfer
    from drake_aerial.demo import run_demo
    from drake_aerial.visualization.file_view import cloud_view, skill_view, write_contacts_page
    from drake_aerial.visualization.replay import write_replay

    pages = {name: folder / f"{name}.html" for name in ("cloud", "skill", "contacts", "trial")}
    np.save(folder / "bunny.npy", read_scan("bunny").points)
    bunny, triangle = read_scan(folder / "bunny.npy"), read_scan("hollow_triangle")
    cloud_view(bunny).write(pages["cloud"])
    skill_view(read_skill("formation")).write(pages["skill"])
    write_contacts_page(pages["contacts"], transfer(read_skill("curved"), bunny), bunny)
    found = transfer(read_skill("formation"), triangle, top=1)
    write_replay(
        pages["trial"],
        prepare_flight(found, payload="hollow_triangle").run(0),
        title="Three quadrotors",
    )
    run_demo(folder / "demo")
    return pages | {"report": folder / "demo" / "report.html"}


def demonstrate(folder: Path) -> AbstractContextManager:
    """Return the server of a page on which contacts are clicked on a table's top."""
    import trimesh

    from drake_aerial import PointCloud
    from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
    from drake_aerial.annotation.demonstration_server import DemonstrationServer

    table = trimesh.creation.box((0.6, 0.4, 0.3))
    points = trimesh.sample.sample_surface(table, 20000, seed=0)[0]
    return DemonstrationServer(DemonstrationDraft(PointCloud.read(points)), folder / "shown.yaml")


def click_contacts(page) -> None:
    """Click two contacts on the page of `demonstrate`."""
    page.wait_for_function("window.demonstration && window.demonstration.ready")
    for count, place in enumerate(([0.2, 0.1, 0.15], [-0.2, -0.1, 0.15]), 1):
        page.mouse.click(*page.evaluate("p => window.demonstration.project(p)", place)[:2])
        page.wait_for_function("n => document.querySelectorAll('#list li').length === n", arg=count)


def take_screenshots(pages: dict[str, Path], folder: Path, work: Path) -> None:
    """Write one PNG per page, with both screens."""
    from playwright.sync_api import sync_playwright

    installed = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=installed, args=FLAGS)
        shots = []
        for width, height in SCREENS:
            with demonstrate(work) as server:
                page = browser.new_page(viewport={"width": width, "height": height})
                page.goto(server.url)
                click_contacts(page)
                shots.append(page.screenshot())
                page.close()
        _write_sheet(folder / "demonstrate.png", shots)
        for name, path in pages.items():
            shots = []
            for width, height in SCREENS:
                page = browser.new_page(viewport={"width": width, "height": height})
                page.goto(path.resolve().as_uri())
                if name == "trial":
                    # A fixed time late on the circle, so that the PNG is reproducible.
                    page.evaluate("viewer.animator.pause(), replay.seek(11)")
                page.wait_for_timeout(2500)
                shots.append(page.screenshot())
                page.close()
            _write_sheet(folder / f"{name}.png", shots)
        browser.close()


def _write_sheet(path: Path, shots: list[bytes]) -> None:
    images = [Image.open(io.BytesIO(shot)).convert("RGB") for shot in shots]
    images = [
        image.resize((image.width * HEIGHT // image.height, HEIGHT), Image.Resampling.LANCZOS)
        for image in images
    ]
    sheet = Image.new(
        "RGB", (sum(image.width for image in images) + 3 * GAP, HEIGHT + 2 * GAP), (208, 213, 219)
    )
    left = GAP
    for image in images:
        sheet.paste(image, (left, GAP))
        left += image.width + GAP
    # MAXCOVERAGE keeps rare colours, which the legends refer to.
    sheet.quantize(200, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        path, optimize=True
    )
    size = path.stat().st_size
    print(f"{path}: {size / 1000:.0f} kB", file=sys.stderr)
    if size > LARGEST:
        raise SystemExit(f"{path} must have at most {LARGEST} bytes, got {size}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder", nargs="?", type=Path, default=ROOT / "docs" / "images" / "pages", metavar="DIR"
    )
    parser.add_argument(
        "--study", type=Path, help="folder of a study, whose report.html is included"
    )
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        pages = make_pages(Path(work))
        if arguments.study is not None:
            pages["study"] = arguments.study / "report.html"
        take_screenshots(pages, arguments.folder, Path(work))
