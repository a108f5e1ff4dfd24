"""Contacts for cable-suspended aerial transport: learnt from one demonstration, transferred, and flown in Drake.

The names below are loaded when they are first used, so that ``import drake_aerial`` itself costs next to nothing.
"""

from __future__ import annotations

__version__ = "0.1.0"

# What type checkers take for true; the real one's module takes longer to import than everything else here.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from drake_aerial.configuration import defaults_text, parameters_text, read_parameters
    from drake_aerial.control.controller_parameters import GeometricParameters, MpcParameters
    from drake_aerial.control.disturbance import DisturbanceObserver
    from drake_aerial.control.geometric import GeometricController
    from drake_aerial.control.mpc import PayloadMpc
    from drake_aerial.demo import run_demo
    from drake_aerial.errors import DrakeAerialError, InputError, JobError
    from drake_aerial.learning.demonstration import Demonstration
    from drake_aerial.learning.learn import learn
    from drake_aerial.learning.skill import ContactSkill
    from drake_aerial.named_inputs import read_scan, read_skill
    from drake_aerial.perception.point_cloud import PointCloud
    from drake_aerial.perception.surface_features import SurfaceFeatures, compute_features
    from drake_aerial.perception.views import partial_view
    from drake_aerial.plant.cable import add_cable
    from drake_aerial.plant.dryden import Dryden
    from drake_aerial.plant.gripper import add_gripper
    from drake_aerial.plant.payload import Payload
    from drake_aerial.plant.payload_body import add_payload
    from drake_aerial.plant.quadrotor import add_quadrotor
    from drake_aerial.plant.wind import WindParameters
    from drake_aerial.study.campaign import StudySummary, run_study
    from drake_aerial.study.conditions import Condition
    from drake_aerial.study.plan import StudyPlan
    from drake_aerial.study.report import write_report
    from drake_aerial.transferring.program import ContactProgram
    from drake_aerial.transferring.refinement import refine
    from drake_aerial.transferring.solutions import ContactSolutions
    from drake_aerial.transferring.transfer import transfer
    from drake_aerial.transport.diagram_picture import write_diagram_picture
    from drake_aerial.transport.flight_options import FlightOptions
    from drake_aerial.transport.station import make_transport_station
    from drake_aerial.transport.station_parameters import StationParameters
    from drake_aerial.transport.trial import TrialResult, fly, prepare_flight

_HOMES = {
    "Condition": "study.conditions",
    "ContactProgram": "transferring.program",
    "ContactSkill": "learning.skill",
    "ContactSolutions": "transferring.solutions",
    "Demonstration": "learning.demonstration",
    "DisturbanceObserver": "control.disturbance",
    "DrakeAerialError": "errors",
    "Dryden": "plant.dryden",
    "FlightOptions": "transport.flight_options",
    "GeometricController": "control.geometric",
    "GeometricParameters": "control.controller_parameters",
    "InputError": "errors",
    "JobError": "errors",
    "MpcParameters": "control.controller_parameters",
    "Payload": "plant.payload",
    "PayloadMpc": "control.mpc",
    "PointCloud": "perception.point_cloud",
    "StationParameters": "transport.station_parameters",
    "StudyPlan": "study.plan",
    "StudySummary": "study.campaign",
    "SurfaceFeatures": "perception.surface_features",
    "TrialResult": "transport.trial",
    "WindParameters": "plant.wind",
    "add_cable": "plant.cable",
    "add_gripper": "plant.gripper",
    "add_payload": "plant.payload_body",
    "add_quadrotor": "plant.quadrotor",
    "compute_features": "perception.surface_features",
    "defaults_text": "configuration",
    "fly": "transport.trial",
    "learn": "learning.learn",
    "make_transport_station": "transport.station",
    "parameters_text": "configuration",
    "partial_view": "perception.views",
    "prepare_flight": "transport.trial",
    "read_parameters": "configuration",
    "read_scan": "named_inputs",
    "read_skill": "named_inputs",
    "refine": "transferring.refinement",
    "run_demo": "demo",
    "run_study": "study.campaign",
    "transfer": "transferring.transfer",
    "write_diagram_picture": "transport.diagram_picture",
    "write_report": "study.report",
}

__all__ = [
    "Condition",
    "ContactProgram",
    "ContactSkill",
    "ContactSolutions",
    "Demonstration",
    "DisturbanceObserver",
    "DrakeAerialError",
    "Dryden",
    "FlightOptions",
    "GeometricController",
    "GeometricParameters",
    "InputError",
    "JobError",
    "MpcParameters",
    "Payload",
    "PayloadMpc",
    "PointCloud",
    "StationParameters",
    "StudyPlan",
    "StudySummary",
    "SurfaceFeatures",
    "TrialResult",
    "WindParameters",
    "add_cable",
    "add_gripper",
    "add_payload",
    "add_quadrotor",
    "compute_features",
    "defaults_text",
    "fly",
    "learn",
    "make_transport_station",
    "parameters_text",
    "partial_view",
    "prepare_flight",
    "read_parameters",
    "read_scan",
    "read_skill",
    "refine",
    "run_demo",
    "run_study",
    "transfer",
    "write_diagram_picture",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"drake_aerial.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'drake_aerial' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
