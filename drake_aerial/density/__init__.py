"""Kernels and kernel densities over surface features and poses."""
