"""Trajectories and controllers as LeafSystems."""
