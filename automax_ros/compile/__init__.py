"""Program to function: the compiler and its lowerings."""
