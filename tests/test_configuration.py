"""Configuration files of every noun: defaults read back, bad values are refused."""

import json
import re
from dataclasses import fields, replace

import pytest
import yaml

from drake_aerial import (
    StationParameters,
    WindParameters,
    defaults_text,
    parameters_text,
    read_parameters,
)
from drake_aerial.cli import main
from drake_aerial.configuration import NOUNS, read_controller, read_station
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.control.controller_parameters import (
    CONTROLLERS,
    GeometricGains,
    GeometricParameters,
    MpcParameters,
    MpcWeights,
)
from drake_aerial.density.surface_density import Bandwidth
from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.observation import PositionFilter
from drake_aerial.features.surface_features import FeatureParameters
from drake_aerial.io.records import record_from_mapping
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.parameters import LearningParameters
from drake_aerial.statics.lift import Lift

STRONG = QuadrotorParameters(mass=1 / 3, inertia=(2e-3, 2e-3, 3.5e-3), thrust_coefficient=1.4e-8)
GUSTY = WindParameters(mean=(3.0, 0.1, 0.0), turbulence=Dryden((1.0, 1.0, 0.5), (2.0, 2.0, 1 / 3)))
OTHERS = [
    ("quadrotor", STRONG),
    ("cable", CableParameters("elastic", 0.8, 1e4, 20.0)),
    ("gripper", GripperParameters(holding_force=float("inf"))),
    ("wind", GUSTY),
    (
        "station",
        StationParameters(
            STRONG, (CableParameters(length=0.4), CableParameters()), noise=0.0, wind=GUSTY
        ),
    ),
    ("controller", MpcParameters(stages=10, weights=MpcWeights(swing=1.0), field_of_view=1.2)),
    ("controller", MpcParameters(observer=DisturbanceObserver(moment_time=float("inf")))),
    ("controller", GeometricParameters("geometric", GeometricGains(rate=(1e-9, 2.0, 3.0)))),
    ("controller", GeometricParameters(position_filter=PositionFilter(0.0))),
    ("features", FeatureParameters(rho=0.02, voxel=0.0)),
    ("bandwidths", Bandwidth(rotation=1 / 3)),
    ("learning", LearningParameters(FeatureParameters(rho=0.04), axial=False)),
    (
        "transfer",
        TransferParameters(
            "rigid", temperature=(2.0, 1e-3), lift=Lift(0.5, (7.0, 8.0), (0.25, 0.3))
        ),
    ),
]
KINDS = [("controller", kind) for kind in CONTROLLERS] + [("cable", "elastic")]
WITH_DEFAULTS = [noun for noun in NOUNS if noun != "payload"]


@pytest.mark.parametrize(
    ("noun", "parameters"), OTHERS, ids=lambda value: value if isinstance(value, str) else ""
)
def test_whatever_is_written_reads_back_equal(noun, parameters, tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(parameters_text(parameters))
    assert read_parameters(noun, path) == parameters


@pytest.mark.parametrize(("noun", "kind"), [(noun, None) for noun in WITH_DEFAULTS] + KINDS)
def test_defaults_are_those_of_the_classes(noun, kind, tmp_path):
    path = tmp_path / "file.yaml"
    assert main(["defaults", noun, "--out", str(path), *(["--kind", kind] if kind else [])]) == 0
    assert path.read_text() == defaults_text(noun, kind)
    parameters = read_parameters(noun, path)
    if noun == "controller":
        assert parameters == CONTROLLERS[kind or "mpc"]
        assert parameters.kind == (kind or "mpc")
    else:
        assert parameters == (type(parameters)(kind=kind) if kind else type(parameters)())
    written = yaml.safe_load(path.read_text())
    assert list(written) == [f.name for f in fields(parameters)]


def test_the_payload_stands_for_itself(tmp_path):
    path = tmp_path / "payload.yaml"
    path.write_text(defaults_text("payload"))
    assert read_parameters("payload", path).mass == 0.25


def test_names_that_are_none_are_refused_with_the_nearest(tmp_path):
    with pytest.raises(
        InputError,
        match=r"`noun` must be one of quadrotor, .*, got 'griper' \(did you mean 'gripper'",
    ):
        defaults_text("griper")
    with pytest.raises(
        InputError, match=r"mpc, geometric_ff, geometric, got 'geometry' \(did you mean 'geometric'"
    ):
        read_controller("geometry")
    with pytest.raises(InputError, match=r"`cable` .* got 'elastik' \(did you mean 'elastic'\?\)"):
        read_station(cable="elastik")
    for noun in ("wind", "payload"):
        with pytest.raises(InputError, match="`kind` must not be given"):
            defaults_text(noun, kind="elastic")
    with pytest.raises(InputError, match="`kind` must be one of inextensible, elastic, got 'rope'"):
        defaults_text("cable", kind="rope")


def test_a_station_is_put_together_from_files(tmp_path):
    (tmp_path / "strong.yaml").write_text("mass: 0.5")
    (tmp_path / "weak.yaml").write_text("mass: 0.2")
    (tmp_path / "short.yaml").write_text("length: 0.3")
    (tmp_path / "station.yaml").write_text(
        "quadrotor: [strong.yaml, {mass: 0.3}]\n"
        "cable: {length: 0.7}\nnoise: 0\nwind: {mean: [1, 0, 0]}\n"
    )
    station = read_station(tmp_path / "station.yaml")
    assert [q.mass for q in station.quadrotors(2)] == [0.5, 0.3]
    assert (station.cable.length, station.noise, station.wind.mean) == (0.7, 0.0, (1.0, 0.0, 0.0))
    assert read_station(tmp_path / "station.yaml", cable="elastic").cable == CableParameters(
        "elastic", 0.7
    )
    changed = read_station(
        tmp_path / "station.yaml", cable=tmp_path / "short.yaml", quadrotor=tmp_path / "weak.yaml"
    )
    assert changed == replace(
        station, cable=CableParameters(length=0.3), quadrotor=QuadrotorParameters(mass=0.2)
    )
    assert read_station() == StationParameters()


def test_impossible_values_are_refused(tmp_path):
    for noun, text, word in (
        ("station", "time_step: 0", "`time_step` must be in (0, 0.01] s, got 0"),
        ("station", "noise: -1", "`noise` must be >= 0 m, got -1"),
        ("station", "cable: {length: 0}", "`cable.length` must be >= 0.001 m, got 0"),
        (
            "controller",
            "{kind: mpc, weights: {position: -1}}",
            "`weights.position` must be >= 0, got -1",
        ),
        ("controller", "{kind: mpc, weights: {input: 0}}", "`weights.input` must be > 0, got 0"),
        ("controller", "{kind: geometric, stages: 3}", "unknown key 'stages'"),
        ("bandwidths", "rotation: 0", "`rotation` must be > 0 rad, got 0"),
        ("transfer", "steps: 0", "`steps` must be >= 1, got 0"),
        (
            "transfer",
            "scale: supprt",
            "`scale` must be one of auto, support, area, rigid, got 'supprt' "
            "(did you mean 'support'?)",
        ),
        ("transfer", "voters: many", "`voters` must be a whole number, got 'many'"),
    ):
        (tmp_path / "file.yaml").write_text(text)
        with pytest.raises(InputError, match=rf"file\.yaml: .*{re.escape(word)}"):
            read_parameters(noun, tmp_path / "file.yaml")


def test_drakes_own_yaml_loader_does_not_read_the_classes():
    """As docs/api/configuration.md says; should this test fail, the page can be changed."""
    from pydrake.common.yaml import yaml_load_typed

    for kind in (CableParameters, StationParameters, MpcParameters, TransferParameters):
        with pytest.raises(Exception):  # noqa: B017, PT011 (Drake raises bare AssertionErrors)
            yaml_load_typed(schema=kind, data=parameters_text(kind()))


def test_options_given_beside_a_controller_count(tmp_path):
    options = FlightOptions(controller="mpc", controller_options={"stages": 7, "offset": 0.001})
    assert options.controller_parameters == MpcParameters(stages=7)
    assert (
        FlightOptions(controller=GeometricParameters()).controller_parameters
        == GeometricParameters()
    )
    assert FlightOptions(controller=lambda model: None).controller_parameters is None


def test_verbs_take_files_and_results_keep_what_was_used(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name, text in {
        "learning": "{features: {rho: 0.04}, task_features: 40}",
        "transfer": "{candidates: 1000, starts: 50, chains: 20, steps: 50}",
        "station": "{quadrotor: strong.yaml, noise: 0.002}",
        "strong": "{mass: 0.3, thrust_coefficient: 9.0e-9}",
        "cable": "{kind: elastic, length: 0.6}",
        "wind": "mean: [0.5, 0, 0]",
        "controller": "{kind: mpc, stages: 12, weights: {position: 90}}",
        "hover": "{kind: hover, hover_time: 0.5}",
        "wrong": "{rho: 0.04}",
    }.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    learn = ["learn", "flat", "--out", "skill.npz", "--parameters"]
    assert main([*learn, "wrong.yaml"]) == 2
    assert "wrong.yaml: unknown key 'rho'" in capsys.readouterr().err
    assert main([*learn, "learning.yaml"]) == 0
    parameters = ContactSkill.load("skill.npz").parameters
    assert parameters == LearningParameters(FeatureParameters(rho=0.04), task_features=40)

    transfer = [
        "transfer",
        "skill.npz",
        "box_68x68x28",
        "--out",
        "contacts.json",
        "--mass",
        "0.2",
        "--parameters",
    ]
    assert main([*transfer, "transfer.yaml"]) == 0
    used = ContactSolutions.read("contacts.json").parameters
    assert used.lift.payload_mass == pytest.approx(0.202)  # with the gripper
    assert replace(used, lift=None) == TransferParameters(
        candidates=1000, starts=50, chains=20, steps=50
    )

    fly = [
        "fly",
        "contacts.json",
        "--out",
        "flight",
        "--trajectory",
        "hover.yaml",
        "--station",
        "station.yaml",
    ]
    fly += ["--payload", "box_68x68x28"]
    parts = ["--cable", "cable.yaml", "--wind", "wind.yaml", "--controller", "controller.yaml"]
    assert main([*fly, *parts]) == 0
    configuration = json.loads((tmp_path / "flight" / "metrics.json").read_text())["configuration"]
    station = record_from_mapping(StationParameters, configuration["station"], "metrics.json")
    assert station == StationParameters(
        quadrotor=QuadrotorParameters(mass=0.3, thrust_coefficient=9e-9),
        cable=CableParameters("elastic", 0.6),
        noise=0.002,
        wind=WindParameters(mean=(0.5, 0.0, 0.0)),
    )
    given = record_from_mapping(
        MpcParameters, configuration["controller_parameters"], "metrics.json"
    )
    assert given == MpcParameters(stages=12, weights=MpcWeights(position=90.0))
    assert configuration["controller"] == "mpc"
