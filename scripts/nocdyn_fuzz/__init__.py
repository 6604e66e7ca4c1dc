"""Mutated inputs and command lines against nocdyn: `scripts/fuzz --help`."""
