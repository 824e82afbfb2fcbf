"""Long work on many hands: campaigns, and the limits that are made from them; endurance."""
