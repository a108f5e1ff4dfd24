"""The report of a study: figures, tables and the page. No numbers of its own."""
