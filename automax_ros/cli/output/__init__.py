"""What subcommands write and show: files, the terminal, pictures; and signals."""
