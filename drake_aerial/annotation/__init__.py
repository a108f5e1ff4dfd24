"""Creation of demonstrations: contacts by position or by clicks in a browser. No learning."""
