"""Wrong arguments of add_* and connect_* are refused at once, by the argument's name."""

import subprocess
import sys
import textwrap

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from drake_aerial.errors import InputError
from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.air_drag import connect_air
from drake_aerial.plant.cable import add_cable
from drake_aerial.plant.cable_forces import connect_cables
from drake_aerial.plant.gripper import GripperParameters, add_gripper
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor, connect_propellers
from drake_aerial.plant.world import add_plant

TOP = [0.0, 0.0, 0.1]


class Parts:
    def __init__(self, finalized):
        self.builder = DiagramBuilder()
        self.plant, _ = add_plant(self.builder)
        self.box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
        self.payload, self.quadrotor = add_payload(self.plant, self.box), add_quadrotor(self.plant)
        self.gripper = add_gripper(self.plant, self.payload, TOP)
        self.cable = add_cable(self.plant, self.quadrotor, self.gripper)
        self.other = add_payload(self.plant, self.box, name="other")
        self.other_cable = add_cable(
            self.plant,
            add_quadrotor(self.plant, name="other_quadrotor"),
            add_gripper(self.plant, self.other, TOP, name="other_gripper"),
            name="other_cable",
        )
        if finalized:
            self.plant.Finalize()

    def state(self, part):
        return self.plant.get_state_output_port(part.model_instance)


ADDING = {
    "a name for a payload": (
        lambda p: add_payload(p.plant, "bunny", name="b"),
        r"`payload` must be a Payload .* got a str",
    ),
    "a plant's builder": (
        lambda p: add_payload(p.builder, p.box, name="b"),
        r"`plant` must be a MultibodyPlant, got a DiagramBuilder",
    ),
    "a mass for a quadrotor": (
        lambda p: add_quadrotor(p.plant, 0.25, name="b"),
        r"`parameters` must be a QuadrotorParameters or None, got a float",
    ),
    "a rigid body for a payload": (
        lambda p: add_gripper(p.plant, p.payload.body, TOP, name="b"),
        r"`payload` must be a PayloadBody as add_payload returns it, got a RigidBody",
    ),
    "a payload that is no body": (
        lambda p: add_gripper(p.plant, p.box, TOP, name="b"),
        r"`payload` must be a PayloadBody as add_payload returns it, got a Payload",
    ),
    "two numbers for a contact": (
        lambda p: add_gripper(p.plant, p.payload, [0.0, 0.1], name="b"),
        r"`p_LC` must be 3 finite numbers, got \[0.0, 0.1\]",
    ),
    "two contacts for one": (
        lambda p: add_gripper(p.plant, p.payload, [TOP, TOP], name="b"),
        r"`p_LC` must be 3 finite numbers",
    ),
    "NaN in a contact": (
        lambda p: add_gripper(p.plant, p.payload, [0.0, np.nan, 0.1], name="b"),
        r"`p_LC` must be 3 finite numbers",
    ),
    "a word for a contact": (
        lambda p: add_gripper(p.plant, p.payload, "top", name="b"),
        r"`p_LC` must be 3 finite numbers, got 'top'",
    ),
    "a normal of zero": (
        lambda p: add_gripper(p.plant, p.payload, TOP, [0.0, 0.0, 0.0], name="b"),
        r"`normal_L` must not be zero",
    ),
    "NaN in a normal": (
        lambda p: add_gripper(p.plant, p.payload, TOP, [0.0, 0.0, np.nan], name="b"),
        r"`normal_L` must be 3 finite numbers",
    ),
    "a force for a gripper": (
        lambda p: add_gripper(p.plant, p.payload, TOP, parameters=20.0, name="b"),
        r"`parameters` must be a GripperParameters or None, got a float",
    ),
    "a rigid body for a quadrotor": (
        lambda p: add_cable(p.plant, p.quadrotor.body, p.gripper, name="b"),
        r"`quadrotor` must be a Quadrotor as add_quadrotor returns it, got a RigidBody",
    ),
    "a payload for a gripper": (
        lambda p: add_cable(p.plant, p.quadrotor, p.payload, name="b"),
        r"`gripper` must be a Gripper as add_gripper returns it, got a PayloadBody",
    ),
    "a gripper's parameters for a cable": (
        lambda p: add_cable(p.plant, p.quadrotor, p.gripper, GripperParameters(), name="b"),
        r"`parameters` must be a CableParameters or None, got a GripperParameters",
    ),
    "connecting before Finalize": (
        lambda p: connect_propellers(p.builder, p.plant, [p.quadrotor]),
        r"`plant` must be finalized: call plant\.Finalize\(\)",
    ),
}

CONNECTING = {
    "adding after Finalize": (
        lambda p: add_quadrotor(p.plant, name="b"),
        r"`plant` must not be finalized",
    ),
    "one quadrotor for a list": (
        lambda p: connect_propellers(p.builder, p.plant, p.quadrotor),
        r"`quadrotors` must be a list of one or more Quadrotor, got a Quadrotor",
    ),
    "no quadrotors": (
        lambda p: connect_propellers(p.builder, p.plant, []),
        r"`quadrotors` must be a list of one or more Quadrotor, got an empty one",
    ),
    "bodies for quadrotors": (
        lambda p: connect_propellers(p.builder, p.plant, [p.quadrotor.body]),
        r"`quadrotors\[0\]` must be a Quadrotor as add_quadrotor returns it, got a RigidBody",
    ),
    "a negative motor lag": (
        lambda p: connect_propellers(p.builder, p.plant, [p.quadrotor], motor_lag=-0.1),
        r"time constant must be positive",
    ),
    "no cables": (
        lambda p: connect_cables(p.builder, p.plant, [], p.state(p.payload), p.state(p.quadrotor)),
        r"`cables` must be a list of one or more Cable, got an empty one",
    ),
    "grippers for cables": (
        lambda p: connect_cables(
            p.builder, p.plant, [p.gripper], p.state(p.payload), p.state(p.quadrotor)
        ),
        r"`cables\[0\]` must be a Cable as add_cable returns it, got a Gripper",
    ),
    "cables on two payloads": (
        lambda p: connect_cables(
            p.builder,
            p.plant,
            [p.cable, p.other_cable],
            p.state(p.payload),
            p.state(p.quadrotor),
        ),
        r"`cables` must be on one payload: call connect_cables once per payload",
    ),
    "a payload that is no body, in air": (
        lambda p: connect_air(
            p.builder,
            p.plant,
            p.box,
            [p.quadrotor],
            p.state(p.payload),
            p.state(p.quadrotor),
            AirParameters(),
        ),
        r"`payload` must be a PayloadBody as add_payload returns it, got a Payload",
    ),
    "a vector for air": (
        lambda p: connect_air(
            p.builder,
            p.plant,
            p.payload,
            [p.quadrotor],
            p.state(p.payload),
            p.state(p.quadrotor),
            (1.0, 0.0, 0.0),
        ),
        r"`parameters` must be a AirParameters, got a tuple",
    ),
}


@pytest.mark.parametrize("what", ADDING)
def test_a_wrong_part_is_refused_when_it_is_added(what):
    call, words = ADDING[what]
    with pytest.raises(InputError, match=words) as refused:
        call(Parts(finalized=False))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("what", CONNECTING)
def test_a_wrong_part_is_refused_when_it_is_connected(what):
    call, words = CONNECTING[what]
    with pytest.raises(InputError, match=words) as refused:
        call(Parts(finalized=True))
    assert "\n" not in str(refused.value)


def test_a_normal_of_any_length_is_scaled_to_one():
    parts = Parts(finalized=False)
    gripper = add_gripper(parts.plant, parts.payload, TOP, [0.0, 3.0, 4.0], name="b")
    assert gripper.normal_L == pytest.approx([0.0, 0.6, 0.8])


def test_a_payload_that_is_welded_to_the_world_holds_a_cable():
    # In a process of its own, because the solver crashes the interpreter on the world body itself.
    # The payload is welded to the world and a quadrotor without thrust hangs below it.
    script = """
        from pydrake.systems.analysis import Simulator
        from pydrake.math import RigidTransform
        from pydrake.systems.framework import DiagramBuilder
        from drake_aerial import Payload, add_cable, add_gripper, add_payload, add_quadrotor
        from drake_aerial.plant.world import add_plant

        plant, _ = add_plant(builder := DiagramBuilder())
        payload = add_payload(plant, Payload.from_box([0.4, 0.4, 0.2]))
        quadrotor = add_quadrotor(plant)
        X = RigidTransform([0.0, 0.0, 3.0])
        plant.WeldFrames(plant.world_frame(), payload.body.body_frame(), X)
        cable = add_cable(plant, quadrotor, add_gripper(plant, payload, [0.0, 0.0, -0.1]))
        plant.Finalize()
        simulator = Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetFreeBodyPose(context, quadrotor.body, RigidTransform([0.0, 0.0, 2.4]))
        cable.place(plant, context)
        simulator.AdvanceTo(0.5)
        print(plant.EvalBodyPoseInWorld(context, quadrotor.body).translation()[2])
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert float(done.stdout) == pytest.approx(2.4, abs=2e-3)
