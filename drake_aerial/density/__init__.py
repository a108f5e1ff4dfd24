"""Kernels, kernel densities over features, poses and grids, resampling. No contacts."""
