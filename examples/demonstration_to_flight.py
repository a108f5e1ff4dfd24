"""From one demonstration to a flight: learn, scan a new payload, transfer, fly."""

import numpy as np
import trimesh

from drake_aerial import Demonstration, LineTrajectory, Payload, fly, learn, partial_view, transfer

skill = learn(Demonstration.read("flat"))  # a gripper in the middle of a box's top

# A camera at (1.1, -1.3, 1.5) m sees one side of another box, with 2 mm of noise.
payload = Payload.read("box_68x68x28")
mesh = trimesh.Trimesh(payload.vertices, payload.faces)
rng = np.random.default_rng(0)
scan = partial_view(mesh, (1.1, -1.3, 1.5), noise=0.002, rng=rng)

contacts = transfer(skill, scan, seed=0)
line = LineTrajectory(displacement=(1.5, 0.0, 0.0), lift_time=2.0, line_time=3.0, hover_time=1.0)
flight = fly(contacts, payload=payload, trajectory=line, seed=0)

print(f"{len(scan):,} points; contact at {contacts.best.X_SG.p[0].round(3)} m")
print(flight.summary())
