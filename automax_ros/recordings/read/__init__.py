"""Reading recordings: messages, blocks of messages, the write log, checks of soundness."""
