"""How a control block is declared, and what declarations share."""
