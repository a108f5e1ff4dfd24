"""A cost of one's own in the program that refines a contact: stay near a point.

The program maximises the likelihood of the contact, subject to its feasibility. A quadratic cost on
the decision variables p_SG moves the contact away from the middle of the box.
"""

import numpy as np

from drake_aerial import ContactProgram, read_scan, read_skill, transfer

skill = read_skill("flat")
contacts = transfer(skill, read_scan("box_68x68x28"), top=1)
point = np.array([0.15, 0.1])  # x and y in the scan's frame [m]

refined = {}
for weight in (0.0, 100.0, 10000.0):  # [1/m^2], against the logarithm of the likelihood
    program = ContactProgram(skill, contacts.query, contacts.best, reach=0.2)
    p = program.positions()[0]
    program.prog().AddQuadraticErrorCost(weight * np.eye(2), point, p[:2])
    refined[weight] = program.solve().solution

for weight, solution in refined.items():
    verdict = "feasible" if solution.feasible else solution.reasons
    print(f"weight {weight:g}: contact at {solution.X_SG.p[0].round(3)} m, {verdict}")
