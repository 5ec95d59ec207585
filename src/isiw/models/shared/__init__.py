"""Parts that families of models have in common; the families do not know each other."""
