"""Making a demonstration: contacts by position or by clicks in a browser. It learns nothing."""
