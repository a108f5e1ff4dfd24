"""A controller of one's own, flown with the shipped sensors, take-off and metrics."""

import drake_aerial as da


class AboveIt(da.PayloadController):
    """Each quadrotor tracks the point above its contact; the payload swings freely."""

    def compute_thrusts(self, t, observation, reference, thrust, memory):
        model, desired = self.model, reference.sample(t)
        above = desired.p + model.p_LC + model.cable_length[:, None] * [0.0, 0.0, 1.0]
        acceleration = desired.a + [0.0, 0.0, 9.81]
        acceleration = acceleration + 6.0 * (above - observation.p_WQ)
        acceleration = acceleration + 4.0 * (desired.v - observation.v_WQ)
        return (model.quadrotor_mass + model.mass / model.n)[:, None] * acceleration


box = da.Payload.from_box([0.4, 0.4, 0.2], mass=0.25)
held = da.SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
line = da.LineTrajectory(displacement=(1.0, 0.0, 0.0), lift_time=2.0, line_time=3.0, hover_time=1.0)
flights = {
    name: da.Flight(held, da.FlightOptions(controller=controller, trajectory=line)).run(seed=0)
    for name, controller in (("above it", AboveIt), ("mpc", "mpc"))
}
for name, flight in flights.items():
    print(f"{name}: {flight.summary()}")
