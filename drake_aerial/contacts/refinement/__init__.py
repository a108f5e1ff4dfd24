"""Refinement of contacts as a MathematicalProgram: variables, costs, constraints, solvers."""
