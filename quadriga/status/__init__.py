"""How a team is at this moment: gathered from what it sends and says, judged, and shown."""
