"""Characters to tokens and logical lines."""
