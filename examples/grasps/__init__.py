"""The 33 grasps of the GRASP taxonomy on an emulated hand: made, pulled at by gravity, pushed, and drawn."""
