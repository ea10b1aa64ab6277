"""The hardware path on one machine: simulated robots behind their own protocols, and the team."""
