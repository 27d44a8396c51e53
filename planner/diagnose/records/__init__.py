"""Records that are not what the table says: power-ons off, other units, references that changed."""
