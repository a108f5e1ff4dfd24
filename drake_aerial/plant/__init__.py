"""Parts of a MultibodyPlant: payload, quadrotor, cable, gripper, wind, ground. No controller."""
