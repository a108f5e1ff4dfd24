"""Images, plots and HTML pages of clouds, skills, contacts and flights. No computed results."""
