"""Kernels and kernel densities over features, poses and grids, and resampling. Nothing of contacts."""
