"""What the robot senses and does: cameras, physics, environments."""
