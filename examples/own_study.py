"""A study of one's own: two methods on one payload, flown several times, with a report."""

import tempfile
from pathlib import Path

from drake_aerial import Condition, HoverTrajectory, StudyPlan, run_study, write_report
from drake_aerial.study.plan import Flights

wide = Condition(
    "wide",
    "box_68x68x28",
    title="flat -> box 68x68x28",
    demonstration="flat",
    view="top",
    trajectory=HoverTrajectory(hover_time=2.0),
)
flights = Flights(("wide",), methods=("task", "kopicki"), solutions=1, trials=2)
plan = StudyPlan("own", (wide,), (flights,), description="Does the task model help on a box?")

folder = Path(tempfile.mkdtemp()) / "study"
summary = run_study(plan, folder)  # the same call resumes an interrupted study
print(summary.outcomes)
print(write_report(folder).page)
