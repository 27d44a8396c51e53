"""The nouns between stages, one file a noun: frozen, SI and radians inside, temperatures in degC."""
