"""The command line `automax`: a folder for each group of subcommands, a file for each of them."""
