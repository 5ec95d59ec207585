"""The gallery: every table and figure of the dissertation's chapters 3 to 8 and B, ours beside the text's numbers."""
