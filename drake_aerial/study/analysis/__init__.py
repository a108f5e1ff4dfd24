"""Numbers of a study from its records: statistics, intervals, claims. No pages."""
