"""Common memory: views, registers, images, the ordered write log."""
