import json

import numpy as np
import pytest

from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload
from drake_aerial.cli import main
from drake_aerial.references.trajectory import HoverTrajectory


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    held = SuspendedPayload.from_contacts(box, [[0.1, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    Flight(held, FlightOptions(trajectory=HoverTrajectory(hover_time=1.0))).run(0).save(folder)
    return folder


def test_the_table_has_estimate_deviation_and_truth(folder, capsys):
    assert main(["identify", str(folder)]) == 0
    out = capsys.readouterr().out
    mass = next(line for line in out.splitlines() if line.startswith("mass"))
    estimate, std, truth = map(float, mass.split("]")[1].split())
    assert estimate == pytest.approx(0.25, rel=2e-3)
    assert truth == 0.25
    assert 0.0 < std < 0.01


def test_json_is_one_line_with_covariance(folder, capsys):
    assert main(["identify", str(folder / "trial.npz"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "drake_aerial/identification"
    assert (np.linalg.eigvalsh(document["com_covariance"]) > 0.0).all()


def test_a_short_flight_and_a_missing_one_are_refused_in_one_line(folder, tmp_path, capsys):
    from dataclasses import replace

    from drake_aerial import TrialResult

    trial = TrialResult.load(folder)
    short = {name: values[:60] for name, values in trial.series.items()}
    replace(trial, series=short).save(tmp_path)
    assert main(["identify", str(tmp_path)]) == 1
    assert "at least 4 windows" in capsys.readouterr().err
    assert main(["identify", str(tmp_path / "nothing")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
