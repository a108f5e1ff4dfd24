"""A disturbance observer: the MPC holds a payload in a wind that it is not told of."""

import drake_aerial as da

box = da.Payload.from_box([0.4, 0.4, 0.2], mass=0.25)
held = da.SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
windy = da.StationParameters(wind=da.WindParameters(mean=(3.0, 0.0, 0.0)))  # [m/s]

flights = {}
for name, observer in (("without", "off"), ("with", da.DisturbanceObserver())):
    options = da.FlightOptions(
        controller=da.MpcParameters(observer=observer),
        trajectory=da.HoverTrajectory(hover_time=6.0),
        parameters=windy,
    )
    flights[name] = da.Flight(held, options).run(seed=0)

for name, flight in flights.items():
    error = flight.series["payload_position"] - flight.series["reference_position"]
    drift = 100.0 * error[-50:].mean(axis=0)
    print(f"{name} observer: {drift.round(1)} cm off the reference at the end")
