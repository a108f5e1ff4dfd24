"""Forces of the air in a plant: terminal velocity, damping of a swing, and buoyancy."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import PrismaticJoint, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, Multiplexer

from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.air_drag import connect_air
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor
from drake_aerial.plant.wind import WindParameters
from drake_aerial.plant.world import add_plant
from drake_aerial.statics.gravity import GRAVITY

BOX = Payload.from_box([0.4, 0.3, 0.2], 0.25)


class Fall:
    """A box and a quadrotor in air, each free."""

    def __init__(self, air, wind=None, weightless=False, step=0.001):
        builder = DiagramBuilder()
        self.plant, _ = add_plant(builder, step)
        self.payload = add_payload(self.plant, BOX, air=air)
        self.quadrotor = add_quadrotor(self.plant)
        if weightless:
            self.plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        self.plant.Finalize()
        states = builder.AddSystem(Multiplexer([13]))
        port = self.plant.get_state_output_port
        builder.Connect(port(self.quadrotor.model_instance), states.get_input_port(0))
        _, forces = connect_air(
            builder,
            self.plant,
            self.payload,
            [self.quadrotor],
            port(self.payload.model_instance),
            states.get_output_port(),
            air,
            wind,
        )
        builder.Connect(forces, self.plant.get_applied_generalized_force_input_port())
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for body, height in ((self.payload.body, 100.0), (self.quadrotor.body, 120.0)):
            self.plant.SetFreeBodyPose(self.context, body, RigidTransform([height, 0.0, height]))

    def velocity(self, part, seconds):
        self.simulator.AdvanceTo(seconds)
        return self.plant.GetVelocities(self.context, part.model_instance)


def test_wind_carries_both_along_at_the_pace_of_their_laws():
    # Payload: m v' = -c v^2 for the speed relative to the air, v = v0 / (1 + c v0 t / m), with
    # the air that moves along in m. Quadrotor: v' = -d v.
    air = AirParameters()
    fall = Fall(air, WindParameters(mean=(0.0, 6.0, 0.0)), weightless=True)
    mass = 0.25 + 1.68 * 1.225 * 0.024
    # Without gravity the buoyancy lifts the box, a little: the oracle has both components.
    lift = 1.68 * 1.225 * 0.024 * GRAVITY / mass
    K = 0.5 * 1.225 * 1.05 * np.array([0.4 * 0.2, 0.4 * 0.3]) / mass
    v = np.array([-6.0, 0.0])
    for _ in range(20000):
        v = v + 1e-4 * (np.array([0.0, lift]) - np.linalg.norm(v) * K * v)
    found = fall.velocity(fall.payload, 2.0)
    assert found == pytest.approx([0, 0, 0, 0, 6.0 + v[0], v[1]], abs=3e-3)
    found = fall.velocity(fall.quadrotor, 2.0)
    expected = 6.0 * (1.0 - np.exp(-0.465 * 2.0))
    assert found == pytest.approx([0, 0, 0, 0, expected, 0], abs=3e-3)


def test_a_box_falls_at_its_terminal_velocity_by_what_a_scale_shows():
    fall = Fall(AirParameters())
    velocity = fall.velocity(fall.payload, 4.0)
    terminal = np.sqrt(2.0 * 0.25 * GRAVITY / (1.225 * 1.05 * 0.4 * 0.3))
    assert velocity == pytest.approx([0, 0, 0, 0, 0, -terminal], abs=1e-2)


def test_a_box_starts_to_fall_with_the_inertia_of_the_air_that_moves_along():
    fall = Fall(AirParameters(payload_drag=0.0))
    velocity = fall.velocity(fall.payload, 0.5)
    displaced = 1.225 * 0.4 * 0.3 * 0.2
    assert velocity[5] == pytest.approx(-GRAVITY * 0.5 * 0.25 / (0.25 + 1.68 * displaced), rel=1e-3)


def test_quadratic_drag_damps_a_swing_by_its_energy():
    """A long pendulum: amplitude a falls as a0 / (1 + 4 c l w a0 t / (3 pi m))."""
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, 0.005)
    air, length, amplitude = AirParameters(added_mass=0.0), 5.0, 0.3
    body, quadrotor = add_payload(plant, BOX, air=air), add_quadrotor(plant)
    # A constraint needs two moving bodies: the pivot may move across the plane of the swing.
    ball, instance = SpatialInertia.SolidSphereWithMass(1.0, 0.1), plant.AddModelInstance("pivot")
    pivot = plant.AddRigidBody("pivot", instance, ball)
    frames = plant.world_frame(), pivot.body_frame()
    plant.AddJoint(PrismaticJoint("across", *frames, [0.0, 1.0, 0.0]))
    plant.AddBallConstraint(pivot, np.zeros(3), body.body, [0.0, 0.0, length])
    plant.Finalize()
    states = builder.AddSystem(Multiplexer([13]))
    port = plant.get_state_output_port
    builder.Connect(port(quadrotor.model_instance), states.get_input_port(0))
    _, forces = connect_air(
        builder,
        plant,
        body,
        [quadrotor],
        port(body.model_instance),
        states.get_output_port(),
        air,
    )
    builder.Connect(forces, plant.get_applied_generalized_force_input_port())
    log = LogVectorOutput(port(body.model_instance), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    start = [-length * np.sin(amplitude), 0.0, -length * np.cos(amplitude)]
    tilt = RotationMatrix.MakeYRotation(amplitude)
    plant.SetFreeBodyPose(context, body.body, RigidTransform(tilt, start))
    plant.SetFreeBodyPose(context, quadrotor.body, RigidTransform([50.0, 0.0, 0.0]))
    simulator.AdvanceTo(10.0)
    x = log.FindLog(simulator.get_context()).data()[4]
    mass = 0.25 + 1.225 * 0.024
    rate = np.sqrt(0.25 / mass * GRAVITY / length)
    c = 0.5 * 1.225 * 1.05 * 0.3 * 0.2
    period = int(2 * np.pi / rate / 0.01)
    last = len(x) - period + int(np.abs(x[-period:]).argmax())
    decay = 4.0 * c * length * rate * amplitude * 0.01 * last / (3.0 * np.pi * mass)
    measured = np.arcsin(abs(x[last]) / length)
    assert measured == pytest.approx(amplitude / (1.0 + decay), rel=0.04)
    assert measured < 0.6 * amplitude
