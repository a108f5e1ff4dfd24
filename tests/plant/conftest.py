"""A rig of one payload and one quadrotor on a cable, with constant propeller commands."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import ExternallyAppliedSpatialForceMultiplexer
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_aerial.plant.cable import CableParameters, add_cable
from drake_aerial.plant.cable_forces import connect_cables
from drake_aerial.plant.gripper import GripperParameters, add_gripper
from drake_aerial.plant.payload import TABLE_INERTIA, Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import QuadrotorParameters, add_quadrotor, connect_propellers
from drake_aerial.plant.world import ELASTIC_TIME_STEP, TIME_STEP, add_ground, add_plant


@dataclass
class Rig:
    plant: object
    payload: object
    quadrotor: object
    gripper: object
    cable: object
    cables: object
    simulator: object

    def __post_init__(self):
        self.root = self.simulator.get_mutable_context()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)

    def place(
        self,
        p_payload,
        p_quadrotor,
        rpy=(0, 0, 0),
        v_payload=(0, 0, 0),
        v_quadrotor=(0, 0, 0),
        w=(0, 0, 0),
    ):
        plant, context = self.plant, self.context
        plant.SetFreeBodyPose(
            context, self.payload.body, RigidTransform(np.asarray(p_payload, float))
        )
        X_WQ = RigidTransform(RollPitchYaw(rpy), np.asarray(p_quadrotor, float))
        plant.SetFreeBodyPose(context, self.quadrotor.body, X_WQ)
        V = SpatialVelocity(w=np.asarray(w, float), v=np.asarray(v_payload, float))
        plant.SetFreeBodySpatialVelocity(context, self.payload.body, V)
        V = SpatialVelocity(w=np.zeros(3), v=np.asarray(v_quadrotor, float))
        plant.SetFreeBodySpatialVelocity(context, self.quadrotor.body, V)
        self.cable.place(plant, context)
        self.simulator.Initialize()

    def tension(self):
        port = self.cables.tension
        return float(port.Eval(port.get_system().GetMyContextFromRoot(self.root))[0])

    def state(self, what):
        """Return pose and velocity (13,) of the payload or the quadrotor."""
        instance = getattr(self, what).model_instance
        return self.plant.GetPositionsAndVelocities(self.context, instance)


@pytest.fixture
def rig():
    def make(
        kind="inextensible",
        *,
        payload=None,
        p_LC=(0.0, 0.0, 0.0),
        normal=(0.0, 0.0, 1.0),
        holding_force=np.inf,
        thrust=None,
        commands=None,
        gravity=True,
        ground=False,
        install=True,
        monitor=None,
        **cable,
    ):
        builder = DiagramBuilder()
        plant, _ = add_plant(builder, ELASTIC_TIME_STEP if kind == "elastic" else TIME_STEP)
        if ground:
            add_ground(plant)
        if not gravity:
            plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        payload = (
            Payload.from_box([0.68, 0.61, 0.28], inertia=TABLE_INERTIA)
            if payload is None
            else payload
        )
        body = add_payload(plant, payload)
        quadrotor = add_quadrotor(plant)
        gripper = add_gripper(
            plant, body, p_LC, normal, GripperParameters(holding_force=holding_force)
        )
        added = add_cable(plant, quadrotor, gripper, CableParameters(kind=kind, **cable))
        plant.Finalize()
        states = [plant.get_state_output_port(i.model_instance) for i in (body, quadrotor)]
        cables = connect_cables(builder, plant, [added], *states)
        forces = [] if cables.forces is None else [cables.forces]
        if thrust is not None:
            commands = np.full(4, thrust / 4.0 / QuadrotorParameters().thrust_coefficient)
        if commands is not None:
            port, propellers = connect_propellers(builder, plant, [quadrotor])
            source = builder.AddSystem(ConstantVectorSource(np.asarray(commands, float)))
            builder.Connect(source.get_output_port(), port)
            forces.append(propellers)
        if forces:
            sum_ = builder.AddSystem(ExternallyAppliedSpatialForceMultiplexer(len(forces)))
            for k, force in enumerate(forces):
                builder.Connect(force, sum_.get_input_port(k))
            builder.Connect(sum_.get_output_port(), plant.get_applied_spatial_force_input_port())
        simulator = Simulator(builder.Build())
        if monitor is not None:
            simulator.set_monitor(monitor)
        if install:
            cables.install(simulator)
        return Rig(plant, body, quadrotor, gripper, added, cables, simulator)

    return make
