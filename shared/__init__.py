"""What both sides of the bus agree on: messages, topics, configuration, the robot."""
