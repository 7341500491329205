"""From .BLK text to a checked program: lexer, parser, syntax tree, printer, checker."""
