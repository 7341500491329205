"""Recordings read: messages, blocks of messages, the write log, whether they are sound."""
