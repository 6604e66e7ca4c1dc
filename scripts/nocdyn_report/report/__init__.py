"""The report on a machine: nocdyn report."""
