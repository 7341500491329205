"""Text to tree: lexer, parser, syntax tree, printer."""
