"""Three quadrotors carry what is too heavy for one: contacts from one demonstration, flown."""

import numpy as np
import trimesh

from drake_aerial import LineTrajectory, Payload, PointCloud, fly, read_skill, transfer

# Shown on a hollow triangle; the new one is 1.3 times as large and weighs 1 kg.
shape = Payload.read("hollow_triangle")
payload = Payload.from_mesh(trimesh.Trimesh(1.3 * shape.vertices, shape.faces), mass=1.0)
contacts = transfer(read_skill("formation"), PointCloud.read(payload.to_trimesh()), top=1)

line = LineTrajectory(displacement=(1.0, 0.0, 0.0), lift_time=3.0, line_time=2.0, hover_time=1.0)
flight = fly(contacts, payload=payload, trajectory=line, seed=0)

# Three vertical cables hold a level payload in one way: forces and moments balance.
arms = contacts.best.X_SG.p[:, :2] - payload.com[:2]
expected = np.linalg.solve(np.vstack([np.ones(3), arms.T]), [9.81 * payload.mass, 0.0, 0.0])
flown = flight.series["tension"][-50:].mean(axis=0)
print(flight.summary())
print("tensions at the end", flown.round(2), "N; from statics", expected.round(2), "N")
