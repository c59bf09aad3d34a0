"""Reading stripes: phasors, matched along epipolar lines."""
