"""What the experiments share: how one is described, how a hand is driven, and operations on what was recorded."""
