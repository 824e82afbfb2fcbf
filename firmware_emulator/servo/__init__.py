"""One HLS3606M bus servo: registers, encodings, motion profile, electrical and thermal behaviour."""
