"""Whether a contact can be flown, and the reasons against it."""
