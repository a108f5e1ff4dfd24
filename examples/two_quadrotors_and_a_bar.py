"""Two quadrotors carry a bar. The controller is a LeafSystem connected to the station's ports."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_aerial import Payload, make_transport_station

CONTACTS = np.array([[-0.4, 0.0, 0.03], [0.4, 0.0, 0.03]])  # on the bar, in its frame [m]


class Lifter(LeafSystem):
    """Raises each quadrotor by 1.5 m in 5 s: spring, damper, and its share of the weight."""

    def __init__(self):
        super().__init__()
        # Per quadrotor: w x y z, position, angular and linear velocity, in the world.
        self._quadrotors = self.DeclareVectorInputPort("quadrotor_states", 26)
        # In the world [N].
        self.DeclareVectorOutputPort("thrust_vectors", 6, self._calc)

    def _calc(self, context, output):
        state = self._quadrotors.Eval(context).reshape(2, 13)
        height = 0.5 + 1.5 * min(context.get_time() / 5.0, 1.0)
        target = CONTACTS * [1.0, 1.0, 0.0] + [0.0, 0.0, height]
        thrust = 6.0 * (target - state[:, 4:7]) - 3.0 * state[:, 10:13] + [0.0, 0.0, 3.9]
        output.SetFromVector(thrust.ravel())


builder = DiagramBuilder()
bar = Payload.from_box([1.0, 0.06, 0.06], mass=0.3)
station = builder.AddSystem(make_transport_station(bar, CONTACTS))
lifter = builder.AddSystem(Lifter())
builder.Connect(station.GetOutputPort("perception.quadrotor_states"), lifter.get_input_port())
builder.Connect(lifter.get_output_port(), station.GetInputPort("attitude.thrust_vectors"))
simulator = Simulator(builder.Build())
station.place(simulator.get_mutable_context())
simulator.AdvanceTo(10.0)
context = station.GetMyContextFromRoot(simulator.get_context())
state = station.GetOutputPort("payload.state").Eval(context)
print("the bar is at", state[4:7].round(3))
