"""What makes the shipped data, and long work on many hands: campaigns, limits, identification, endurance."""
