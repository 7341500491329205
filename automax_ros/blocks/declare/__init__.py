"""The declaration of a control block, and the parts that declarations share."""
