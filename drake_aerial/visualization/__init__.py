"""Pictures, pages, plots and Meshcat scenes of clouds, skills, contacts and flights. No computation of results."""
