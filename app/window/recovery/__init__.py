"""What lasts from one day to the next, and what a crash must not take."""
