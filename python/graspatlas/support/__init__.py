"""What every package stands on: checked arguments, interrupts, limits of time, text for a terminal."""
