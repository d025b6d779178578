"""What every package stands on: files, checked arguments, interrupts, text for a terminal."""
