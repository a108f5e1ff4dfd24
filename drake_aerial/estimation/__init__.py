"""What is known of the flying state: sensors, the position filter, the disturbance observer. No control law."""
