"""Mutants of the laws, each with one wrong constant or sign: does a verification case fail?"""
