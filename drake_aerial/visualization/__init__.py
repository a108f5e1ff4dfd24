"""Images, plots and HTML pages of the method's values and of flights. It computes no results."""
