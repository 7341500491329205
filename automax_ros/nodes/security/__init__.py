"""SROS 2 for a rack: what its nodes open, a policy of it, and keys for those who take part."""
