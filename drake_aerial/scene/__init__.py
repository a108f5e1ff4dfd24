"""Scenes: from sensor data to point clouds. No files of points, which are in `cloud`."""
