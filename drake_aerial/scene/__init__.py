"""Sensor data as point clouds: depth cameras and images. Point files are in `cloud`."""
