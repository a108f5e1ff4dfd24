"""The study: conditions, campaign, records, statistics, figures, report."""
