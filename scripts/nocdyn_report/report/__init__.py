"""The report on a machine: scripts/report."""
