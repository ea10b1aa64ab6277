"""Bridges: the plant of one real robot, which speaks the robot's own protocol."""
