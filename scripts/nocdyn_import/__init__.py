"""Inputs from machines of other programs: nocdyn import."""
