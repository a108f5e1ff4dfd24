"""A depth camera in a diagram: what it sees of a payload becomes a scan with contacts."""

import pydrake.geometry as geometry
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_aerial import Payload, add_payload, add_plant, read_depth_image, read_skill, transfer

builder = DiagramBuilder()
plant, scene_graph = add_plant(builder)
engine = geometry.MakeRenderEngineVtk(geometry.RenderEngineVtkParams())
scene_graph.AddRenderer("vtk", engine)
add_payload(plant, Payload.read("box_68x61x28"))
plant.Finalize()

info = CameraInfo(width=320, height=240, fov_y=0.6)
clipping = geometry.ClippingRange(0.1, 5.0)
core = geometry.RenderCameraCore("vtk", info, clipping, RigidTransform())
camera = geometry.DepthRenderCamera(core, geometry.DepthRange(0.1, 5.0))  # [m]
X_WC = RigidTransform(RotationMatrix.MakeXRotation(-2.4), [0.1, -1.4, 1.5])  # z into the image
sensor = builder.AddSystem(RgbdSensor(scene_graph.world_frame_id(), X_WC, camera))
builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())

diagram = builder.Build()
context = sensor.GetMyContextFromRoot(diagram.CreateDefaultContext())
image = sensor.depth_image_32F_output_port().Eval(context)
scan_C = read_depth_image(image, info, up=X_WC.rotation().inverse() @ [0.0, 0.0, 1.0])
contacts = transfer(read_skill("flat"), scan_C)
print("contact at", (X_WC @ contacts.best.X_SG.p[0]).round(3), "m in the world")
