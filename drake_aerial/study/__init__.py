"""Studies: plan, conditions, trials, records, workers. Numbers: `analysis`; pages: `report`."""
