"""Parts in a plant of one's own: a quadrotor with constant thrust lifts a box off the ground."""

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

import drake_aerial as da

builder = DiagramBuilder()
plant, scene_graph = da.add_plant(builder, time_step=0.002)
da.add_ground(plant)
box = da.add_payload(plant, da.Payload.from_box([0.4, 0.4, 0.2], mass=0.25))
quadrotor = da.add_quadrotor(plant)
cable = da.add_cable(plant, quadrotor, da.add_gripper(plant, box, [0.0, 0.0, 0.1]))
cable.set_default_pose(plant, slack=0.0)
plant.Finalize()
states = [plant.get_state_output_port(part.model_instance) for part in (box, quadrotor)]
thrust = builder.AddSystem(ConstantVectorSource([0.0, 0.0, 6.0]))  # in the world [N]
attitude = builder.AddSystem(da.AttitudeController.of_quadrotors([quadrotor.parameters]))
builder.Connect(states[1], attitude.GetInputPort("quadrotor_states"))
builder.Connect(thrust.get_output_port(), attitude.GetInputPort("thrust_vectors"))
commands, forces = da.connect_propellers(builder, plant, [quadrotor])
builder.Connect(attitude.GetOutputPort("propeller_commands"), commands)
builder.Connect(forces, plant.get_applied_spatial_force_input_port())
cables = da.connect_cables(builder, plant, [cable], *states)
logs = [LogVectorOutput(port, builder, 0.01) for port in (*states, cables.tension)]
simulator = Simulator(builder.Build())
cables.install(simulator)
simulator.AdvanceTo(1.0)
print(f"tension {logs[2].FindLog(simulator.get_context()).data()[0, -1]:.2f} N")
