"""The names of the package and the modules that they are loaded from; see `lazy_loader`."""

from .cloud.partial_views import partial_view
from .cloud.point_cloud import PointCloud
from .configuration import defaults_text, parameters_text, read_parameters
from .contacts.parameters import TransferParameters
from .contacts.refinement.program import ContactProgram
from .contacts.refinement.refine import refine
from .contacts.solutions import ContactSolutions
from .contacts.transfer import transfer
from .control.attitude import AttitudeController
from .control.controller import PayloadController
from .control.controller_parameters import (
    GeometricGains,
    GeometricParameters,
    MpcParameters,
    MpcWeights,
)
from .control.geometric import GeometricController
from .control.mpc.payload_mpc import PayloadMpc
from .demo import run_demo
from .dynamics.path_check import PathCheck, check_path
from .dynamics.path_limits import CarriedPayload, PathLimits
from .dynamics.retiming import retime
from .errors import DrakeAerialError, InputError, JobError
from .estimation.disturbance_observer import DisturbanceObserver
from .estimation.mass_identification import identify_payload
from .estimation.sensor_parameters import SensorParameters
from .estimation.state_sensor import StateSensor
from .features.surface_features import FeatureParameters, SurfaceFeatures, compute_features
from .named_inputs import read_scan, read_skill
from .plant.cable import CableParameters, add_cable
from .plant.cable_forces import connect_cables
from .plant.dryden import Dryden
from .plant.gripper import GripperParameters, add_gripper
from .plant.payload import Payload
from .plant.payload_body import add_payload
from .plant.quadrotor import QuadrotorParameters, add_quadrotor, connect_propellers
from .plant.wind import WindParameters
from .plant.world import add_ground, add_plant
from .references.trajectory import (
    HoverTrajectory,
    LineTrajectory,
    Trajectory,
    TransportTrajectory,
    WaypointTrajectory,
)
from .scene.depth_camera import DepthCamera
from .scene.depth_image import read_depth_image
from .scene.find_scene import find_scene
from .scene.fused_views import fuse_views
from .scene.scene import Scene
from .simulation.diagram_picture import write_diagram_picture
from .simulation.flight import Flight
from .simulation.flight_options import FlightOptions
from .simulation.path_preparation import carried_payload
from .simulation.recorded_motion import recorded_motion
from .simulation.station import make_transport_station
from .simulation.station_parameters import StationParameters
from .simulation.suspended_payload import SuspendedPayload
from .simulation.trial import fly, prepare_flight
from .simulation.trial_result import TrialResult
from .skill.contact_skill import ContactSkill
from .skill.demonstration import Demonstration
from .skill.learn import learn
from .skill.parameters import LearningParameters
from .study.campaign import StudySummary, run_study
from .study.conditions import Condition
from .study.plan import StudyPlan
from .study.report.study_report import write_report

__version__: str

__all__ = [
    "AttitudeController",
    "CableParameters",
    "CarriedPayload",
    "Condition",
    "ContactProgram",
    "ContactSkill",
    "ContactSolutions",
    "Demonstration",
    "DepthCamera",
    "DisturbanceObserver",
    "DrakeAerialError",
    "Dryden",
    "FeatureParameters",
    "Flight",
    "FlightOptions",
    "GeometricController",
    "GeometricGains",
    "GeometricParameters",
    "GripperParameters",
    "HoverTrajectory",
    "InputError",
    "JobError",
    "LearningParameters",
    "LineTrajectory",
    "MpcParameters",
    "MpcWeights",
    "PathCheck",
    "PathLimits",
    "Payload",
    "PayloadController",
    "PayloadMpc",
    "PointCloud",
    "QuadrotorParameters",
    "Scene",
    "SensorParameters",
    "StateSensor",
    "StationParameters",
    "StudyPlan",
    "StudySummary",
    "SurfaceFeatures",
    "SuspendedPayload",
    "Trajectory",
    "TransferParameters",
    "TransportTrajectory",
    "TrialResult",
    "WaypointTrajectory",
    "WindParameters",
    "add_cable",
    "add_gripper",
    "add_ground",
    "add_payload",
    "add_plant",
    "add_quadrotor",
    "carried_payload",
    "check_path",
    "compute_features",
    "connect_cables",
    "connect_propellers",
    "defaults_text",
    "find_scene",
    "fly",
    "fuse_views",
    "identify_payload",
    "learn",
    "make_transport_station",
    "parameters_text",
    "partial_view",
    "prepare_flight",
    "read_depth_image",
    "read_parameters",
    "read_scan",
    "read_skill",
    "recorded_motion",
    "refine",
    "retime",
    "run_demo",
    "run_study",
    "transfer",
    "write_diagram_picture",
    "write_report",
]
