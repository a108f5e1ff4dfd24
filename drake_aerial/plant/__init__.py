"""Payload, quadrotor, cable, gripper, wind and ground as parts of a MultibodyPlant. No controller."""
