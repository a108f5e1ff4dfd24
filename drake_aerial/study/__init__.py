"""Studies: plan, conditions, trials, records, workers. Numbers are in analysis, pages in report."""
