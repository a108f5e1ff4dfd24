"""Payload, quadrotor, cable and gripper as parts of a MultibodyPlant."""
