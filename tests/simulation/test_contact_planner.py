"""A depth image in a diagram becomes a scan, and on a trigger contacts on its object."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import ImageDepth32F

from drake_aerial import InputError, read_depth_image, read_skill
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.scene.depth_noise import DepthNoise
from drake_aerial.scene.object_choice import ObjectChoice
from drake_aerial.simulation.contact_planner import ContactPlanner
from drake_aerial.simulation.depth_scanner import DepthScanner
from tests.scene import parcels

FEW = TransferParameters(candidates=500, starts=40, chains=20, steps=60)
X_WC = RigidTransform(RotationMatrix(parcels.R_WC), parcels.EYE)
DEPTHS = np.where(parcels.depths([parcels.LARGE]) > 0.0, parcels.depths([parcels.LARGE]), np.inf)
# A camera gives whole millimetres.
DEPTHS = np.round(DEPTHS, 3)


def fixed(scanner, context):
    image = ImageDepth32F(640, 480)
    image.mutable_data[..., 0] = DEPTHS
    scanner.GetInputPort("depth_image").FixValue(context, AbstractValue.Make(image))
    scanner.GetInputPort("X_WC").FixValue(context, AbstractValue.Make(X_WC))


def test_the_scan_is_that_of_the_image_with_the_worlds_up():
    scanner = DepthScanner(parcels.CAMERA)
    context = scanner.CreateDefaultContext()
    fixed(scanner, context)
    scan = scanner.GetOutputPort("scan").Eval(context)
    image = np.where(np.isfinite(DEPTHS), DEPTHS, 0.0).astype(np.float32)
    np.testing.assert_array_equal(scan.points, read_depth_image(image, parcels.CAMERA).points)
    np.testing.assert_allclose(scan.up, parcels.UP_C, atol=1e-12)
    assert scan.up_is_known


def test_noise_follows_from_seed_and_time():
    def points(seed, time):
        scanner = DepthScanner(parcels.CAMERA, DepthNoise(), seed)
        context = scanner.CreateDefaultContext()
        fixed(scanner, context)
        context.SetTime(time)
        return scanner.GetOutputPort("scan").Eval(context).points

    first = points(0, 0.5)
    np.testing.assert_array_equal(first, points(0, 0.5))
    assert len(first) != len(points(1, 0.5))
    assert len(first) != len(points(0, 0.6))


def test_contacts_are_planned_when_the_trigger_rises_and_kept_in_the_context():
    builder = DiagramBuilder()
    scanner = builder.AddSystem(DepthScanner(parcels.CAMERA))
    planner = builder.AddSystem(ContactPlanner(read_skill("flat"), ObjectChoice(2), parameters=FEW))
    builder.Connect(scanner.GetOutputPort("scan"), planner.GetInputPort("scan"))
    builder.ExportInput(planner.GetInputPort("trigger"), "trigger")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    fixed(scanner, scanner.GetMyMutableContextFromRoot(context))
    simulator = Simulator(diagram, context)

    def contacts(root):
        return planner.GetOutputPort("contacts").Eval(planner.GetMyContextFromRoot(root))

    diagram.GetInputPort("trigger").FixValue(context, [0.0])
    simulator.AdvanceTo(0.15)
    assert contacts(context) is None
    diagram.GetInputPort("trigger").FixValue(context, [1.0])
    simulator.AdvanceTo(0.25)
    found = contacts(context)
    p_WG = X_WC @ found.best.X_SG.p[0]
    (x, y), size = parcels.LARGE
    np.testing.assert_allclose(p_WG, [x, y, size[2]], atol=0.03)
    # The trigger stays up: there is no second plan. A copy of the Context has the plan too.
    simulator.AdvanceTo(0.45)
    assert contacts(context).timing == found.timing
    assert contacts(context.Clone()).to_dict()["solutions"] == found.to_dict()["solutions"]


def test_a_period_must_be_positive():
    with pytest.raises(InputError, match=r"must be positive \[s\], got 0.0"):
        ContactPlanner(read_skill("flat"), period=0.0)
