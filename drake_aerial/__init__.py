"""Contacts for cable-suspended aerial transport: learn from one demonstration, transfer, and fly.

The names below are loaded at their first use, which keeps ``import drake_aerial`` fast.
"""

from __future__ import annotations

from drake_aerial._version import __version__ as __version__

# Type checkers treat this name as True; importing it from `typing` would double the import time.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from drake_aerial.cloud.partial_views import partial_view
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.configuration import defaults_text, parameters_text, read_parameters
    from drake_aerial.contacts.refinement.program import ContactProgram
    from drake_aerial.contacts.refinement.refine import refine
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.contacts.transfer import transfer
    from drake_aerial.control.controller_parameters import GeometricParameters, MpcParameters
    from drake_aerial.control.geometric import GeometricController
    from drake_aerial.control.mpc.payload_mpc import PayloadMpc
    from drake_aerial.demo import run_demo
    from drake_aerial.errors import DrakeAerialError, InputError, JobError
    from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
    from drake_aerial.features.surface_features import SurfaceFeatures, compute_features
    from drake_aerial.named_inputs import read_scan, read_skill
    from drake_aerial.plant.cable import add_cable
    from drake_aerial.plant.dryden import Dryden
    from drake_aerial.plant.gripper import add_gripper
    from drake_aerial.plant.payload import Payload
    from drake_aerial.plant.payload_body import add_payload
    from drake_aerial.plant.quadrotor import add_quadrotor
    from drake_aerial.plant.wind import WindParameters
    from drake_aerial.scene.depth_camera import DepthCamera
    from drake_aerial.scene.depth_image import read_depth_image
    from drake_aerial.simulation.diagram_picture import write_diagram_picture
    from drake_aerial.simulation.flight import Flight
    from drake_aerial.simulation.flight_options import FlightOptions
    from drake_aerial.simulation.station import make_transport_station
    from drake_aerial.simulation.station_parameters import StationParameters
    from drake_aerial.simulation.suspended_payload import SuspendedPayload
    from drake_aerial.simulation.trial import fly, prepare_flight
    from drake_aerial.simulation.trial_result import TrialResult
    from drake_aerial.skill.contact_skill import ContactSkill
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn
    from drake_aerial.study.campaign import StudySummary, run_study
    from drake_aerial.study.conditions import Condition
    from drake_aerial.study.plan import StudyPlan
    from drake_aerial.study.report.study_report import write_report

_HOMES = {
    "Condition": "study.conditions",
    "ContactProgram": "contacts.refinement.program",
    "ContactSkill": "skill.contact_skill",
    "ContactSolutions": "contacts.solutions",
    "DepthCamera": "scene.depth_camera",
    "Demonstration": "skill.demonstration",
    "DisturbanceObserver": "estimation.disturbance_observer",
    "DrakeAerialError": "errors",
    "Dryden": "plant.dryden",
    "Flight": "simulation.flight",
    "FlightOptions": "simulation.flight_options",
    "GeometricController": "control.geometric",
    "GeometricParameters": "control.controller_parameters",
    "InputError": "errors",
    "JobError": "errors",
    "MpcParameters": "control.controller_parameters",
    "Payload": "plant.payload",
    "PayloadMpc": "control.mpc.payload_mpc",
    "PointCloud": "cloud.point_cloud",
    "StationParameters": "simulation.station_parameters",
    "StudyPlan": "study.plan",
    "StudySummary": "study.campaign",
    "SurfaceFeatures": "features.surface_features",
    "SuspendedPayload": "simulation.suspended_payload",
    "TrialResult": "simulation.trial_result",
    "WindParameters": "plant.wind",
    "add_cable": "plant.cable",
    "add_gripper": "plant.gripper",
    "add_payload": "plant.payload_body",
    "add_quadrotor": "plant.quadrotor",
    "compute_features": "features.surface_features",
    "defaults_text": "configuration",
    "fly": "simulation.trial",
    "learn": "skill.learn",
    "make_transport_station": "simulation.station",
    "parameters_text": "configuration",
    "partial_view": "cloud.partial_views",
    "prepare_flight": "simulation.trial",
    "read_depth_image": "scene.depth_image",
    "read_parameters": "configuration",
    "read_scan": "named_inputs",
    "read_skill": "named_inputs",
    "refine": "contacts.refinement.refine",
    "run_demo": "demo",
    "run_study": "study.campaign",
    "transfer": "contacts.transfer",
    "write_diagram_picture": "simulation.diagram_picture",
    "write_report": "study.report.study_report",
}

__all__ = [
    "Condition",
    "ContactProgram",
    "ContactSkill",
    "ContactSolutions",
    "Demonstration",
    "DepthCamera",
    "DisturbanceObserver",
    "DrakeAerialError",
    "Dryden",
    "Flight",
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
    "SuspendedPayload",
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
    "read_depth_image",
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
