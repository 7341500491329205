"""What dynamic blocks mean at a scan time: how they respond to steps and to frequencies."""
