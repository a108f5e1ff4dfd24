"""Publish the result of a study with the sources.

Usage: tools/run python tools/publish_study.py STUDY [DIR] --wall S --machine WORDS --commit ID

From the folder of a study with its report, write into DIR (default: docs/paper_study):
records.jsonl.gz and summary.json.gz, whose bytes depend on their content only; the plan; the
figures of the report as PNG; and index.md with tables, verdicts, figures and the run time. No part
of index.md is written by hand.
"""

import argparse
import gzip
import json
import platform
import shutil
import sys
from importlib.metadata import version
from pathlib import Path

from drake_aerial.io.files import write_bytes, write_text
from drake_aerial.io.strict_yaml import read_mapping
from drake_aerial.study.analysis.labels import INERTIA_WORDS, METHOD_ORDER, position
from drake_aerial.study.analysis.quantities import BY_KEY, FAILURES, MAIN

ROOT = Path(__file__).parent.parent
LARGEST = 1_000_000
LEARNT = METHOD_ORDER[:5]


def compressed(path: Path) -> bytes:
    """Return the content of a file, compressed without name and date."""
    return gzip.compress(path.read_bytes(), compresslevel=9, mtime=0)


def figure(group: dict, key: str) -> str:
    """Return a cell with the mean, its interval, and the number of failures."""
    quantity, value = BY_KEY[key], group["quantities"][key]
    if not group["flights"]:
        return "nothing to fly"
    text = f"{quantity.write(value['mean'])} {quantity.bracket(*value['interval'])}".rstrip()
    failures = sum(group[outcome] for outcome in FAILURES)
    return text + (f"; {failures} of {group['flights']} failed" if failures else "")


def table(heads: list[str], rows: list[list[str]]) -> list[str]:
    """Return the lines of a Markdown table."""
    return [f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows)]


def by_condition(groups: list[dict], conditions: list[str], key: str) -> list[str]:
    """Return the table of a quantity: conditions as rows, methods as columns."""
    cells = {(group["condition"], group["method"]): figure(group, key) for group in groups}
    methods = sorted(
        {method for _, method in cells}, key=lambda method: position(METHOD_ORDER, method)
    )
    rows = [
        [c, *[cells.get((c, m), "") for m in methods]]
        for c in conditions
        if any((c, m) in cells for m in methods)
    ]
    return table(["", *methods], rows)


def page(study: Path, summary: dict, plan: dict, took: list[str], pictures: list[str]) -> str:
    """Return index.md."""
    conditions = summary["conditions"]
    titles = {condition["name"]: condition["title"] for condition in plan["conditions"]}
    flights = sum(group["flights"] for group in summary["groups"])
    failures = sum(group[outcome] for group in summary["groups"] for outcome in FAILURES)
    lines = [
        "# The paper's study, as run",
        "",
        f"{flights:,} flights in {len(conditions)} conditions, of which {failures} failed. Written "
        "by `tools/publish_study.py`. How to read it: [reading a study's report]"
        "(../study_report.md). Conclusions: [results](../results.md#the-papers-study).",
        "",
        *[f"- {line}" for line in took],
        "- {download}`records.jsonl.gz`: one line per flight; {download}`summary.json.gz`: every "
        "number of the report; {download}`study.yaml`: the plan.",
        "",
        "## Conditions",
        "",
        *table(
            ["", "condition"],
            [[name, titles.get(name, "").replace("->", "→")] for name in conditions],
        ),
        "",
    ]
    learnt = [g for g in summary["groups"] if g["method"] in LEARNT]
    given = [g for g in summary["groups"] if g["method"] not in LEARNT]
    for belief, inertia in dict.fromkeys((g["belief"], g["inertia"]) for g in summary["groups"]):
        chosen = [g for g in learnt if (g["belief"], g["inertia"]) == (belief, inertia)]
        sites = [g for g in given if (g["belief"], g["inertia"]) == (belief, inertia)]
        lines += [f"## Belief `{belief}`, {INERTIA_WORDS.get(inertia, inertia)}", ""]
        lines += [
            "Distance of the payload from its path [cm]: RMS over circle and hover, mean over "
            "flights with its 95 % interval.",
            "",
        ]
        lines += by_condition(chosen, conditions, MAIN) + [""] if chosen else []
        lines += by_condition(sites, conditions, MAIN) + [""] if sites else []
    lines += ["## The paper's claims", ""]
    rows = []
    for number, claim in enumerate(summary["claims"], 1):
        words = "; ".join(f"{subject}: **{word}**" for subject, word in claim["verdicts"].items())
        rows.append([str(number), claim["claim"], words])
    lines += table(["", "claim", "verdict"], rows) + [""]
    for number, claim in enumerate(summary["claims"], 1):
        if claim["why"]:
            lines += [
                f"Claim {number}, where it does not hold:",
                "",
                *[f"- {why}" for why in claim["why"]],
                "",
            ]
    lines += ["## Contacts and flights", ""]
    for name in conditions:
        own = [p for p in pictures if p.removesuffix(".png").split("-")[1] == name]
        own.sort(key=lambda p: (not p.startswith("contacts"), not p.startswith("offset-"), p))
        lines += [f"### {name}: {titles.get(name, '').replace('->', '→')}", ""]
        lines += [
            text
            for p in own
            for text in (f"![{p.removesuffix('.png').replace('-', ', ')}](figures/{p})", "")
        ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("study", type=Path, help="folder of a study with its report")
    parser.add_argument(
        "folder", nargs="?", type=Path, default=ROOT / "docs" / "paper_study", metavar="DIR"
    )
    parser.add_argument(
        "--command", default="tools/run drake-aerial study --out DIR", help="command of the run"
    )
    parser.add_argument("--wall", type=float, required=True, help="duration of the run [s]")
    parser.add_argument("--machine", required=True, help="description of the machine")
    parser.add_argument("--commit", required=True, help="commit of the sources")
    arguments = parser.parse_args()
    study, folder = arguments.study, arguments.folder
    summary = json.loads((study / "summary.json").read_text())
    records = [json.loads(line) for line in (study / "records.jsonl").read_text().splitlines()]
    cpu = sum(record["timing"]["cpu_s"] for record in records if record.get("timing"))
    transfers = json.loads((study / "timing.json").read_text())["transfers"].values()
    transfer_cpu = sum(transfer["cpu_s"] for transfer in transfers)
    plan = read_mapping(study / "study.yaml")
    took = [
        f"Command: `{arguments.command}`, commit {arguments.commit}, master seed {plan['seed']}.",
        f"drake_aerial {plan['package_version']}, Python {platform.python_version()}, Drake "
        f"{version('drake')}, NumPy {version('numpy')}, Open3D {version('open3d')}; "
        f"{arguments.machine}.",
        f"Duration: {arguments.wall / 60:.0f} minutes; {cpu / 60:.0f} CPU minutes of flights and "
        f"{transfer_cpu / 60:.1f} of transfers.",
    ]
    shutil.rmtree(folder / "figures", ignore_errors=True)
    pictures = []
    for path in sorted((study / "figures").glob("*.png")):
        write_bytes(folder / "figures" / path.name, path.read_bytes())
        pictures.append(path.name)
    for name in ("records.jsonl", "summary.json"):
        data = compressed(study / name)
        if len(data) > LARGEST:
            raise SystemExit(
                f"{name} must have at most {LARGEST} bytes compressed, got {len(data)}"
            )
        write_bytes(folder / f"{name}.gz", data)
    write_text(folder / "study.yaml", (study / "study.yaml").read_text())
    write_text(folder / "index.md", page(study, summary, plan, took, pictures))
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{folder}: {len(pictures)} pictures, {size / 1e6:.1f} MB", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
