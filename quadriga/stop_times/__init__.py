"""How long it takes from each way to stop a team until it has stopped."""
