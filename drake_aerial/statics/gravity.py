"""The acceleration of free fall that the whole package uses."""

GRAVITY = 9.81
"""[m/s^2]"""
