"""Depth images and bags as point clouds; objects of a scene. Point files are in `cloud`."""
