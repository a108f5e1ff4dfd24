"""Estimation of the flying state: sensor, position filter, disturbance observer; no control law."""
