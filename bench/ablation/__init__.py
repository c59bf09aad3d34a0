"""What every step of the default pipeline is worth: it is left out, and the lab says what gets worse."""
