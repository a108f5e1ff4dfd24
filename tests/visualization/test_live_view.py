"""A live Meshcat is served at real time, ends cleanly, and does not change the results."""

import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request

import numpy as np
import pytest
import trimesh

from drake_aerial import Payload, read_scan, read_skill, transfer
from drake_aerial.errors import InputError
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.visualization.live_view import live_flight, live_view


@pytest.fixture(scope="module")
def flight():
    held = SuspendedPayload.from_contacts(
        Payload.from_box([0.4, 0.4, 0.2], 0.25), [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]]
    )
    return Flight(
        held, FlightOptions(trajectory=HoverTrajectory(hover_time=1.0), controller="geometric")
    )


@pytest.fixture(scope="module")
def contacts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    trimesh.creation.box((0.68, 0.68, 0.28)).export(folder / "box.ply")
    found = transfer(read_skill("flat"), read_scan(folder / "box.ply"), method="centroid")
    found.write(folder / "contacts.json")
    return folder / "contacts.json"


def fetched(url):
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read().decode()


def test_a_flight_is_served_while_it_is_simulated_at_real_time_at_most(flight):
    addresses, pages, walls = [], [], []
    with live_flight(flight, tell=addresses.append, patience=0.0) as watch:

        def fetch_and_watch(context):
            watch(context)
            walls.append((context.get_time(), time.monotonic()))
            if len(walls) == 20:
                pages.append(fetched(addresses[0]))

        shown = flight.run(3, watch=fetch_and_watch)
    assert "MeshCat.Viewer" in pages[0]
    assert watch.frames == pytest.approx(1.0 / 0.04, abs=2)
    (t0, wall0), (t1, wall1) = walls[0], walls[-1]
    # The last picture may be a picture's time old.
    assert wall1 - wall0 >= t1 - t0 - 0.04 - 1e-3
    unseen = flight.run(3)
    assert shown.outcome == "completed"
    for name, series in unseen.series.items():
        np.testing.assert_array_equal(shown.series[name], series, err_msg=name)
    with pytest.raises(urllib.error.URLError):
        fetched(addresses[0])


def test_a_port_that_is_taken_or_not_ours_is_refused(contacts):
    with live_view(contacts) as url:
        port = int(url.rsplit(":", 1)[1])
        for bad in (port, 80, 70000):
            with pytest.raises(InputError, match=str(bad)), live_view(contacts, port=bad):
                pass


def started(*arguments):
    command = [
        sys.executable,
        "-m",
        "drake_aerial",
        *map(str, arguments),
        "--live",
        "--no-browser",
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    line = process.stderr.readline()
    return process, re.search(r"http://localhost:\d+", line).group(0)


def ended(process):
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


def test_view_live_serves_until_ctrl_c(contacts):
    process, url = started("view", contacts)
    assert "MeshCat.Viewer" in fetched(url)
    assert ended(process) == (0, "", "")


def test_ctrl_c_ends_a_view_well_as_soon_as_its_address_is_told(contacts, monkeypatch, capsys):
    from drake_aerial.cli import main, view

    def tell_and_be_interrupted(url):
        raise KeyboardInterrupt

    monkeypatch.setattr(view, "say", tell_and_be_interrupted)
    assert main(["view", str(contacts), "--live", "--no-browser"]) == 0
    assert capsys.readouterr().err == ""


def test_ctrl_c_in_a_live_flight_leaves_nothing_behind(contacts, tmp_path):
    process, url = started(
        "fly", contacts, "--payload", "box_68x68x28", "--out", tmp_path / "flight"
    )
    assert "MeshCat.Viewer" in fetched(url)
    code, out, err = ended(process)
    assert (code, out) == (130, "")
    assert "interrupted" in err
    assert "Traceback" not in err
    assert not (tmp_path / "flight").exists()


def test_options_of_live_alone_are_refused(contacts, tmp_path, capsys):
    from drake_aerial.cli import main

    assert (
        main(["view", str(contacts), "--port", "7001", "--out", str(tmp_path / "page.html")]) == 2
    )
    assert "--live" in capsys.readouterr().err
    assert main(["view", str(contacts), "--live", "--out", str(tmp_path / "page.html")]) == 2
    assert not (tmp_path / "page.html").exists()
