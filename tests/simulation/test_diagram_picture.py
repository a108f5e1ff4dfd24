"""The station as Graphviz source and drawing; a script stands for Graphviz's program `dot`."""

import pydot
import pytest

from drake_aerial.errors import InputError, JobError
from drake_aerial.simulation.diagram_picture import diagram_source, write_diagram_picture
from drake_aerial.simulation.station import make_transport_station

DOT = '#!/bin/sh\necho "drawn $1"\n/bin/cat\n'


@pytest.fixture(scope="module")
def station():
    from drake_aerial.plant.payload import Payload

    return make_transport_station(
        Payload.from_box([0.5, 0.4, 0.2], 0.25), [[-0.2, 0.0, 0.1], [0.2, 0.0, 0.1]]
    )


@pytest.fixture
def dot(tmp_path, monkeypatch):
    def install(text):
        folder = tmp_path / "bin"
        folder.mkdir()
        monkeypatch.setenv("PATH", str(folder))
        if text is not None:
            (folder / "dot").write_text(text)
            (folder / "dot").chmod(0o755)

    return install


@pytest.mark.filterwarnings("ignore::DeprecationWarning:pydot")
def test_the_source_is_a_graph_that_names_systems_and_ports(station):
    source = diagram_source(station)
    (graph,) = pydot.graph_from_dot_data(source)
    assert graph.get_type() == "digraph"
    for name in (
        "perception",
        "attitude",
        "propellers",
        "cables",
        "payload.state",
        "attitude.thrust_vectors",
    ):
        assert name in source, name
    assert "propellers_limits" not in diagram_source(station, depth=0)
    with pytest.raises(InputError, match="`depth` must be at least 0, got -1"):
        diagram_source(station, depth=-1)


@pytest.mark.parametrize("suffix", [".dot", ".gv"])
def test_the_source_needs_no_graphviz(station, dot, tmp_path, suffix):
    dot(None)
    write_diagram_picture(tmp_path / f"station{suffix}", station)
    assert (tmp_path / f"station{suffix}").read_text() == diagram_source(station)


@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_a_drawing_is_what_dot_makes_of_the_source(station, dot, tmp_path, suffix):
    dot(DOT)
    write_diagram_picture(tmp_path / f"station{suffix}", station, depth=1)
    expected = f"drawn -T{suffix[1:]}\n{diagram_source(station, depth=1)}"
    assert (tmp_path / f"station{suffix}").read_text() == expected


def test_without_dot_one_line_says_what_to_do(station, dot, tmp_path):
    dot(None)
    with pytest.raises(InputError, match=r"graphviz.*\.dot or \.gv") as error:
        write_diagram_picture(tmp_path / "station.png", station)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "station.png").exists()


def test_a_dot_that_fails_leaves_no_file(station, dot, tmp_path):
    dot("#!/bin/sh\necho 'Format: \"png\" not recognized' >&2\nexit 1\n")
    with pytest.raises(JobError, match="not recognized"):
        write_diagram_picture(tmp_path / "station.png", station)
    assert not (tmp_path / "station.png").exists()


def test_another_suffix_is_refused(station, tmp_path):
    with pytest.raises(InputError, match=r"must end in \.dot, .*\.jpeg"):
        write_diagram_picture(tmp_path / "station.jpeg", station)
