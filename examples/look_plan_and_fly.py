"""Look at a parcel on a floor with a depth camera, plan a contact on it, and fly it."""

import pydrake.geometry as geometry
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_aerial import HoverTrajectory, Payload, add_payload, add_plant, fly, read_skill
from drake_aerial.scene.depth_noise import DepthNoise
from drake_aerial.scene.object_choice import ObjectChoice
from drake_aerial.simulation.contact_planner import ContactPlanner
from drake_aerial.simulation.depth_scanner import DepthScanner

builder = DiagramBuilder()
plant, scene_graph = add_plant(builder)
scene_graph.AddRenderer("vtk", geometry.MakeRenderEngineVtk(geometry.RenderEngineVtkParams()))
add_payload(plant, Payload.read("box_68x61x28"))
floor = RigidTransform([0.0, 0.0, -0.05])  # the parcel stands on it
box = geometry.Box(4.0, 4.0, 0.1)
plant.RegisterVisualGeometry(plant.world_body(), floor, box, "floor", [0.6, 0.6, 0.6, 1.0])
plant.Finalize()

info = CameraInfo(width=640, height=480, fov_y=0.8)
core = geometry.RenderCameraCore("vtk", info, geometry.ClippingRange(0.1, 5.0), RigidTransform())
camera = geometry.DepthRenderCamera(core, geometry.DepthRange(0.1, 5.0))  # [m]
X_WC = RigidTransform(RotationMatrix.MakeXRotation(-2.4), [0.1, -1.4, 1.5])  # z into the image
sensor = builder.AddSystem(RgbdSensor(scene_graph.world_frame_id(), X_WC, camera))
scanner = builder.AddSystem(DepthScanner(info, DepthNoise()))
planner = builder.AddSystem(ContactPlanner(read_skill("flat"), ObjectChoice(pixel=(320, 240))))
builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
builder.Connect(sensor.depth_image_32F_output_port(), scanner.GetInputPort("depth_image"))
builder.Connect(sensor.body_pose_in_world_output_port(), scanner.GetInputPort("X_WC"))
builder.Connect(scanner.GetOutputPort("scan"), planner.GetInputPort("scan"))
trigger = builder.AddSystem(ConstantVectorSource([1.0]))
builder.Connect(trigger.get_output_port(), planner.GetInputPort("trigger"))

simulator = Simulator(builder.Build())
simulator.AdvanceTo(0.0)
context = planner.GetMyContextFromRoot(simulator.get_context())
contacts = planner.GetOutputPort("contacts").Eval(context)
p_WG = X_WC @ contacts.best.X_SG.p[0]
result = fly(contacts, cloud=contacts.scan, trajectory=HoverTrajectory(hover_time=1.0))
print("contact at", p_WG.round(3), "m in the world;", result.outcome)
