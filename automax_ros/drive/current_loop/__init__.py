"""The current minor loop of DC_DRIVE_CML (section 52)."""
