"""Verification: cases with known answers, computed again on this machine and compared."""
